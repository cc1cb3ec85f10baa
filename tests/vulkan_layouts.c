/* vulkan_layouts.c - are the arrays of patchsurf.h what a GPU can work on as they are?

       glslangValidator -V --target-env vulkan1.1 tests/vulkan_layouts.comp \
           -o build/vulkan_layouts.spv
       cc -std=c99 -I. tests/vulkan_layouts.c -o build/vulkan_layouts -lvulkan -lm
       build/vulkan_layouts build/vulkan_layouts.spv

   Copies topology tables, positions, samples, scratch and patches byte for byte into one storage
   buffer, on every Vulkan device there is, and compares with what the library computes:
     - patches constructed by C, evaluated by the GPU (bicubic and P4);
     - vertex data and patches constructed by the GPU from the tables, and evaluated there;
     - shared edges evaluated by the GPU from both sides: the same bits.
   Any warning of the validation layer, where it is installed, is a failure. With
   VK_LAYER_ENABLES=VK_VALIDATION_FEATURE_ENABLE_GPU_ASSISTED_EXT in the environment it watches
   every index too.
   Exit status: 0 passed, 1 failed, 77 there is no Vulkan device. */

#define PSURF_IMPLEMENTATION
#include "patchsurf.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <vulkan/vulkan.h>

#define VK(call) require_vk((call), #call)
#define TYPE(name) .sType = VK_STRUCTURE_TYPE_##name

static const double position_tolerance = 1e-5;      /* of the width of the mesh, CELLS */
static const double normal_tolerance = 1e-4;

static void require(int truth, const char *what)
{
    if (truth) return;
    fprintf(stderr, "vulkan_layouts: %s\n", what);
    exit(1);
}

static void require_vk(VkResult result, const char *what)
{
    if (result == VK_SUCCESS) return;
    fprintf(stderr, "vulkan_layouts: %s gave %d\n", what, (int)result);
    exit(1);
}

static void *allocate(size_t size)
{
    void *memory = calloc(1, size ? size : 1);
    require(memory != NULL, "out of memory");
    return memory;
}

static uint32_t random_state = 2463534242u;
static float random_unit(void)                      /* 0 .. 1 */
{
    random_state ^= random_state << 13;
    random_state ^= random_state >> 17;
    random_state ^= random_state << 5;
    return (float)(random_state >> 8) / 16777215.0f;
}

/* ---- the mesh: a cross of 7 x 27 cubes with a bump, shaken; valences 3 to 6 ------------------ */

enum { CELLS = 9, GRID = CELLS + 1, MAX_FACES = 512, MAX_EDGES = 2 * MAX_FACES };

typedef struct mesh {
    uint32_t vertex_count, face_count, edge_count;
    uint32_t vertex_at[GRID][GRID][GRID];
    uint32_t face_vertices[MAX_FACES][4];
    psurf_edge_tag edges[MAX_EDGES];
    float positions[GRID * GRID * GRID][3];
} mesh;

static int occupied(const int c[3])
{
    int i, middle = 0;
    for (i = 0; i < 3; i++) {
        if (c[i] < 0 || c[i] >= CELLS) return 0;
        middle += c[i] / 3 == 1;
    }
    return middle >= 2 || (c[0] == 7 && c[1] == 4 && c[2] == 6);
}

static uint32_t grid_vertex(mesh *m, const int at[3])
{
    uint32_t *vertex = &m->vertex_at[at[0]][at[1]][at[2]];
    int i;
    if (*vertex == PSURF_NONE) {
        *vertex = m->vertex_count++;
        for (i = 0; i < 3; i++)
            m->positions[*vertex][i] = (float)at[i] + 0.4f * (random_unit() - 0.5f);
    }
    return *vertex;
}

/* The side of a cell towards +axis (side 1) or -axis (side 0), counter-clockwise from outside. */
static void add_side(mesh *m, const int cell[3], int axis, int side)
{
    static const int ring[4][2] = { { 0, 0 }, { 1, 0 }, { 1, 1 }, { 0, 1 } };
    int i;
    for (i = 0; i < 4; i++) {
        const int *step = ring[side ? i : 3 - i];
        int at[3];
        at[axis] = cell[axis] + side;
        at[(axis + 1) % 3] = cell[(axis + 1) % 3] + step[0];
        at[(axis + 2) % 3] = cell[(axis + 2) % 3] + step[1];
        m->face_vertices[m->face_count][i] = grid_vertex(m, at);
    }
    m->face_count++;
}

static void make_edges(mesh *m)
{
    uint32_t f, i;
    for (f = 0; f < m->face_count; f++)
        for (i = 0; i < 4; i++) {
            psurf_edge_tag tag;
            tag.v0 = m->face_vertices[f][i];
            tag.v1 = m->face_vertices[f][(i + 1) % 4];
            tag.flags = PSURF_BLEND;
            tag.blend0 = 0.3f + 0.6f * random_unit();
            tag.blend1 = 0.3f + 0.6f * random_unit();
            if (tag.v0 < tag.v1 && random_unit() < 0.5f) m->edges[m->edge_count++] = tag;
        }
}

static mesh *make_mesh(void)
{
    mesh *m = (mesh *)allocate(sizeof *m);
    int cell[3], axis, side;
    memset(m->vertex_at, 0xFF, sizeof m->vertex_at);
    for (cell[0] = 0; cell[0] < CELLS; cell[0]++)
        for (cell[1] = 0; cell[1] < CELLS; cell[1]++)
            for (cell[2] = 0; cell[2] < CELLS; cell[2]++)
                for (axis = 0; axis < 3 && occupied(cell); axis++)
                    for (side = 0; side < 2; side++) {
                        int beside[3];
                        memcpy(beside, cell, sizeof beside);
                        beside[axis] += side ? 1 : -1;
                        if (!occupied(beside)) add_side(m, cell, axis, side);
                    }
    make_edges(m);
    return m;
}

/* ---- what the library makes of it ------------------------------------------------------------ */

enum { INNER = 6, EDGE_SAMPLES = 6 };       /* samples: INNER x INNER a face, pairs an edge */

typedef struct scene {
    const char *name;
    const mesh *mesh;
    psurf_topology *topology;
    psurf_tables tables;
    psurf_patches patches;
    uint32_t sample_count, pair_first;      /* pairs: samples pair_first + 2 i and + 2 i + 1 */
    psurf_sample *samples;
    float *p, *n;                           /* psurf_eval of the samples */
} scene;

/* The place s along edge i of a quad. r = 1 - s, exactly. */
static psurf_sample edge_sample(uint32_t face, uint32_t i, float s, float r)
{
    psurf_sample at;
    memset(&at, 0, sizeof at);
    at.face = face;
    at.u = i == 0 ? s : i == 1 ? 1.0f : i == 2 ? r : 0.0f;
    at.v = i == 0 ? 0.0f : i == 1 ? s : i == 2 ? 1.0f : r;
    return at;
}

/* The same through a row of the corner table: corner -> kind -> facet -> face. */
static psurf_sample corner_sample(const psurf_tables *t, uint32_t corner, float s, float r)
{
    uint32_t kind = PSURF_BICUBIC, facet, i;
    const psurf_facet *facets = (const psurf_facet *)t->facets.data;
    while (corner >= t->kind_first_corner[kind + 1]) kind++;
    require(kind == PSURF_BICUBIC || kind == PSURF_P4, "an edge belongs to a facet of 4 sides");
    i = corner - t->kind_first_corner[kind];
    facet = t->kind_first[kind] + i / 4;
    return edge_sample(facets[facet].face, i % 4, s, r);
}

static void make_samples(scene *s)
{
    const psurf_edge *edges = (const psurf_edge *)s->tables.edges.data;
    uint32_t f, i, count = 0;
    s->pair_first = s->mesh->face_count * INNER * INNER;
    s->sample_count = s->pair_first + s->tables.edges.count * EDGE_SAMPLES * 2;
    s->samples = (psurf_sample *)allocate(s->sample_count * sizeof *s->samples);
    for (f = 0; f < s->mesh->face_count; f++)
        for (i = 0; i < INNER * INNER; i++) {
            psurf_sample *at = &s->samples[count++];
            at->face = f;
            at->u = (float)(i % INNER) / (INNER - 1);
            at->v = (float)(i / INNER) / (INNER - 1);
        }
    for (f = 0; f < s->tables.edges.count; f++)
        for (i = 0; i < EDGE_SAMPLES; i++) {
            float far = i ? 0.5f + 0.5f * random_unit() : 1.0f, near = 1.0f - far;  /* exact */
            s->samples[count++] = corner_sample(&s->tables, edges[f].corner, far, near);
            s->samples[count++] = corner_sample(&s->tables, edges[f].other, near, far);
        }
}

static void evaluate_scene(scene *s)
{
    psurf_points out;
    memset(&out, 0, sizeof out);
    s->p = out.p = (float *)allocate(s->sample_count * 3 * sizeof(float));
    s->n = out.n = (float *)allocate(s->sample_count * 3 * sizeof(float));
    psurf_eval(&s->patches, s->samples, s->sample_count, &out);
}

static scene make_scene(const mesh *m, const char *name, int blends)
{
    scene s;
    psurf_mesh_desc desc;
    psurf_patches_layout layout;
    psurf_construct_desc construct;
    memset(&s, 0, sizeof s);
    memset(&desc, 0, sizeof desc);
    memset(&construct, 0, sizeof construct);
    s.name = name;
    s.mesh = m;
    desc.vertex_count = m->vertex_count;
    desc.face_count = m->face_count;
    desc.uniform_size = 4;
    desc.face_vertices = &m->face_vertices[0][0];
    desc.edges = blends ? m->edges : NULL;
    desc.edge_count = blends ? m->edge_count : 0;
    require(psurf_topology_create(&desc, &s.topology, NULL) == PSURF_OK, "topology");
    psurf_topology_tables(s.topology, &s.tables);
    require(s.tables.version == PSURF_TABLE_VERSION, "table version");
    require(psurf_patches_size(s.topology, PSURF_PM, &layout) == PSURF_OK, "size of patches");
    require(psurf_patches_bind(&s.patches, s.topology, PSURF_PM, allocate(layout.patch_bytes),
                               allocate(layout.scratch_bytes)) == PSURF_OK, "memory of patches");
    construct.positions = &m->positions[0][0];
    require(psurf_construct(&s.patches, &construct) == PSURF_OK, "construction");
    make_samples(&s);
    evaluate_scene(&s);
    return s;
}

static void free_scene(scene *s)
{
    psurf_topology_destroy(s->topology);
    free(s->patches.patches);
    free(s->patches.scratch);
    free(s->samples);
    free(s->p);
    free(s->n);
}

/* ---- Vulkan: instance and messages ----------------------------------------------------------- */

static int message_count;

static VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT severity,
                                                 VkDebugUtilsMessageTypeFlagsEXT types,
                                                 const VkDebugUtilsMessengerCallbackDataEXT *data,
                                                 void *user)
{
    (void)severity;
    (void)types;
    (void)user;
    fprintf(stderr, "validation: %s\n", data->pMessage);
    message_count++;
    return VK_FALSE;
}

static int layer_installed(const char *name)
{
    VkLayerProperties layers[64];
    uint32_t i, count = 64;
    if (vkEnumerateInstanceLayerProperties(&count, layers) < 0) return 0;
    for (i = 0; i < count; i++)
        if (!strcmp(layers[i].layerName, name)) return 1;
    return 0;
}

typedef struct vulkan {
    VkInstance instance;
    VkDebugUtilsMessengerEXT messenger;
    int validation;
} vulkan;

/* 0: there is no driver. */
static int open_vulkan(vulkan *vk)
{
    static const char *const layer = "VK_LAYER_KHRONOS_validation";
    static const char *const extensions[] = { VK_EXT_DEBUG_UTILS_EXTENSION_NAME,
                                              VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME };
    const VkValidationFeatureEnableEXT sync =
        VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
    const VkDebugUtilsMessengerCreateInfoEXT messages = {
        TYPE(DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT), .pfnUserCallback = on_message,
        .messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                           VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT,
        .messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT };
    const VkValidationFeaturesEXT features = {
        TYPE(VALIDATION_FEATURES_EXT), .pNext = &messages,
        .enabledValidationFeatureCount = 1, .pEnabledValidationFeatures = &sync };
    const VkApplicationInfo application = { TYPE(APPLICATION_INFO),
                                            .apiVersion = VK_API_VERSION_1_1 };
    const uint32_t on = layer_installed(layer) ? 1 : 0;
    const VkInstanceCreateInfo info = {
        TYPE(INSTANCE_CREATE_INFO), .pNext = on ? &features : NULL,
        .pApplicationInfo = &application,
        .enabledLayerCount = on, .ppEnabledLayerNames = &layer,
        .enabledExtensionCount = 2 * on, .ppEnabledExtensionNames = extensions };
    VkResult result = vkCreateInstance(&info, NULL, &vk->instance);
    if (result == VK_ERROR_INCOMPATIBLE_DRIVER) return 0;
    require_vk(result, "vkCreateInstance");
    vk->validation = on == 1;
    if (on) {
        PFN_vkCreateDebugUtilsMessengerEXT create = (PFN_vkCreateDebugUtilsMessengerEXT)
            vkGetInstanceProcAddr(vk->instance, "vkCreateDebugUtilsMessengerEXT");
        require(create != NULL, "the validation layer has no messenger");
        VK(create(vk->instance, &messages, NULL, &vk->messenger));
    }
    return 1;
}

static void close_vulkan(vulkan *vk)
{
    if (vk->validation) {
        PFN_vkDestroyDebugUtilsMessengerEXT destroy = (PFN_vkDestroyDebugUtilsMessengerEXT)
            vkGetInstanceProcAddr(vk->instance, "vkDestroyDebugUtilsMessengerEXT");
        destroy(vk->instance, vk->messenger, NULL);
    }
    vkDestroyInstance(vk->instance, NULL);
}

/* ---- Vulkan: one device with one pipeline per pass ------------------------------------------- */

enum pass { VERTICES, BICUBIC_FACETS, P4_FACETS, EVALUATE, PASS_COUNT };    /* PASS of the shader */

enum binding {
    RINGS, SPOKES, CORNERS, FACETS, TRIG, BLENDS, FACE_FACET, POSITIONS, SAMPLES,
    LIMITS, SPOKE_POINTS, BICUBIC_BLOCK, P4_BLOCK, RESULT, BINDING_COUNT
};

typedef struct push_constants {             /* push_b of the shader */
    uint32_t count, blend_count;
    uint32_t kind_first[PSURF_P5 + 2], kind_first_corner[PSURF_P5 + 2];     /* of pm's kinds */
} push_constants;

typedef struct gpu {
    VkPhysicalDevice physical;
    VkDevice device;
    VkQueue queue;
    VkDescriptorSetLayout set_layout;
    VkPipelineLayout layout;
    VkPipeline pipelines[PASS_COUNT];
    VkDescriptorPool descriptor_pool;
    VkDescriptorSet set;
    VkCommandPool command_pool;
    VkCommandBuffer commands;
} gpu;

/* A queue family that computes, or PSURF_NONE. */
static uint32_t compute_family(VkPhysicalDevice physical)
{
    VkQueueFamilyProperties families[32];
    uint32_t i, count = 32;
    vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families);
    for (i = 0; i < count; i++)
        if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return i;
    return PSURF_NONE;
}

static void make_layouts(gpu *g)
{
    VkDescriptorSetLayoutBinding bindings[BINDING_COUNT];
    const VkDescriptorSetLayoutCreateInfo set = {
        TYPE(DESCRIPTOR_SET_LAYOUT_CREATE_INFO),
        .bindingCount = BINDING_COUNT, .pBindings = bindings };
    const VkPushConstantRange push = { VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof(push_constants) };
    const VkPipelineLayoutCreateInfo pipeline = {
        TYPE(PIPELINE_LAYOUT_CREATE_INFO), .setLayoutCount = 1, .pSetLayouts = &g->set_layout,
        .pushConstantRangeCount = 1, .pPushConstantRanges = &push };
    uint32_t i;
    memset(bindings, 0, sizeof bindings);
    for (i = 0; i < BINDING_COUNT; i++) {
        bindings[i].binding = i;
        bindings[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
        bindings[i].descriptorCount = 1;
        bindings[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
    }
    VK(vkCreateDescriptorSetLayout(g->device, &set, NULL, &g->set_layout));
    VK(vkCreatePipelineLayout(g->device, &pipeline, NULL, &g->layout));
}

static void make_pipelines(gpu *g, const uint32_t *code, size_t code_size)
{
    const VkShaderModuleCreateInfo words = {
        TYPE(SHADER_MODULE_CREATE_INFO), .codeSize = code_size, .pCode = code };
    const VkSpecializationMapEntry entry = { 0, 0, sizeof(uint32_t) };
    VkShaderModule module;
    uint32_t pass;
    VK(vkCreateShaderModule(g->device, &words, NULL, &module));
    for (pass = 0; pass < PASS_COUNT; pass++) {
        const VkSpecializationInfo special = { 1, &entry, sizeof pass, &pass };
        const VkComputePipelineCreateInfo info = {
            TYPE(COMPUTE_PIPELINE_CREATE_INFO), .layout = g->layout,
            .stage = { TYPE(PIPELINE_SHADER_STAGE_CREATE_INFO), .module = module, .pName = "main",
                       .stage = VK_SHADER_STAGE_COMPUTE_BIT, .pSpecializationInfo = &special } };
        VK(vkCreateComputePipelines(g->device, VK_NULL_HANDLE, 1, &info, NULL,
                                    &g->pipelines[pass]));
    }
    vkDestroyShaderModule(g->device, module, NULL);
}

static void make_pools(gpu *g, uint32_t family)
{
    const VkDescriptorPoolSize size = { VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, BINDING_COUNT };
    const VkDescriptorPoolCreateInfo descriptors = {
        TYPE(DESCRIPTOR_POOL_CREATE_INFO), .maxSets = 1, .poolSizeCount = 1, .pPoolSizes = &size };
    const VkCommandPoolCreateInfo pool = {
        TYPE(COMMAND_POOL_CREATE_INFO), .queueFamilyIndex = family,
        .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT };
    VkDescriptorSetAllocateInfo set = {
        TYPE(DESCRIPTOR_SET_ALLOCATE_INFO), .descriptorSetCount = 1,
        .pSetLayouts = &g->set_layout };
    VkCommandBufferAllocateInfo buffer = {
        TYPE(COMMAND_BUFFER_ALLOCATE_INFO), .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1 };
    VK(vkCreateDescriptorPool(g->device, &descriptors, NULL, &g->descriptor_pool));
    VK(vkCreateCommandPool(g->device, &pool, NULL, &g->command_pool));
    set.descriptorPool = g->descriptor_pool;
    buffer.commandPool = g->command_pool;
    VK(vkAllocateDescriptorSets(g->device, &set, &g->set));
    VK(vkAllocateCommandBuffers(g->device, &buffer, &g->commands));
}

static gpu open_gpu(VkPhysicalDevice physical, uint32_t family, const uint32_t *code,
                    size_t code_size)
{
    const float priority = 1;
    const VkDeviceQueueCreateInfo queue = {
        TYPE(DEVICE_QUEUE_CREATE_INFO), .queueFamilyIndex = family, .queueCount = 1,
        .pQueuePriorities = &priority };
    const VkDeviceCreateInfo info = {
        TYPE(DEVICE_CREATE_INFO), .queueCreateInfoCount = 1, .pQueueCreateInfos = &queue };
    gpu g;
    memset(&g, 0, sizeof g);
    g.physical = physical;
    VK(vkCreateDevice(physical, &info, NULL, &g.device));
    vkGetDeviceQueue(g.device, family, 0, &g.queue);
    make_layouts(&g);
    make_pipelines(&g, code, code_size);
    make_pools(&g, family);
    return g;
}

static void close_gpu(gpu *g)
{
    int pass;
    vkDestroyCommandPool(g->device, g->command_pool, NULL);
    vkDestroyDescriptorPool(g->device, g->descriptor_pool, NULL);
    for (pass = 0; pass < PASS_COUNT; pass++)
        vkDestroyPipeline(g->device, g->pipelines[pass], NULL);
    vkDestroyPipelineLayout(g->device, g->layout, NULL);
    vkDestroyDescriptorSetLayout(g->device, g->set_layout, NULL);
    vkDestroyDevice(g->device, NULL);
}

/* ---- one buffer for everything, mapped ------------------------------------------------------- */

typedef struct arena {
    VkBuffer buffer;
    VkDeviceMemory memory;
    char *mapped;
    VkDeviceSize size;
    VkDeviceSize scratch, patches;              /* where they begin */
    VkDescriptorBufferInfo at[BINDING_COUNT];
} arena;

static VkDeviceSize reserve(arena *a, VkDeviceSize size)
{
    VkDeviceSize at = a->size;
    a->size += (size + 255) / 256 * 256 + 256;  /* an empty table still needs a range to bind */
    return at;
}

static void place(arena *a, enum binding binding, VkDeviceSize offset, VkDeviceSize size)
{
    a->at[binding].offset = offset;
    a->at[binding].range = size ? size : 4;
}

/* Tables wherever there is room; scratch and patches as one piece each, with the library's own
   offsets inside. */
static void lay_out(arena *a, const scene *s)
{
    const psurf_patches_layout *l = &s->patches.layout;
    const psurf_kind_block *bicubic = &l->kind[PSURF_BICUBIC], *p4 = &l->kind[PSURF_P4];
    const psurf_table *tables[] = { &s->tables.rings, &s->tables.spokes, &s->tables.corners,
                                    &s->tables.facets, &s->tables.trig, &s->tables.blends,
                                    &s->tables.face_facet };
    const uint32_t strides[] = { 16, 12, 12, 8, 8, 4, 4 };      /* of the shader's structs */
    VkDeviceSize sizes[3];
    int i;
    for (i = 0; i < 7; i++) {
        VkDeviceSize size = (VkDeviceSize)tables[i]->count * tables[i]->stride;
        require(!tables[i]->count || tables[i]->stride == strides[i], "stride of a table");
        place(a, (enum binding)(RINGS + i), reserve(a, size), size);
    }
    sizes[0] = s->mesh->vertex_count * sizeof s->mesh->positions[0];
    sizes[1] = s->sample_count * sizeof(psurf_sample);
    sizes[2] = s->sample_count * 6 * sizeof(float);
    place(a, POSITIONS, reserve(a, sizes[0]), sizes[0]);
    place(a, SAMPLES, reserve(a, sizes[1]), sizes[1]);
    place(a, RESULT, reserve(a, sizes[2]), sizes[2]);
    a->scratch = reserve(a, l->scratch_bytes);
    a->patches = reserve(a, l->patch_bytes);
    place(a, LIMITS, a->scratch + l->limit_offset, s->tables.rings.count * 12);
    place(a, SPOKE_POINTS, a->scratch + l->spoke_offset, s->tables.spokes.count * 24);
    place(a, BICUBIC_BLOCK, a->patches + bicubic->offset, bicubic->count * bicubic->points * 12);
    place(a, P4_BLOCK, a->patches + p4->offset, p4->count * p4->points * 12);
}

static uint32_t host_memory_type(VkPhysicalDevice physical, uint32_t allowed)
{
    const VkMemoryPropertyFlags wanted =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    VkPhysicalDeviceMemoryProperties memory;
    uint32_t i;
    vkGetPhysicalDeviceMemoryProperties(physical, &memory);
    for (i = 0; i < memory.memoryTypeCount; i++)
        if (allowed >> i & 1 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
    require(0, "no memory that both processors see");
    return 0;
}

static void bind_arena(const gpu *g, arena *a)
{
    uint32_t i;
    for (i = 0; i < BINDING_COUNT; i++) {
        const VkWriteDescriptorSet write = {
            TYPE(WRITE_DESCRIPTOR_SET), .dstSet = g->set, .dstBinding = i, .descriptorCount = 1,
            .descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, .pBufferInfo = &a->at[i] };
        a->at[i].buffer = a->buffer;
        vkUpdateDescriptorSets(g->device, 1, &write, 0, NULL);
    }
}

static arena make_arena(const gpu *g, const scene *s)
{
    VkBufferCreateInfo buffer = { TYPE(BUFFER_CREATE_INFO),
                                  .usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT };
    VkMemoryAllocateInfo memory = { TYPE(MEMORY_ALLOCATE_INFO) };
    VkMemoryRequirements needs;
    void *mapped;
    arena a;
    memset(&a, 0, sizeof a);
    lay_out(&a, s);
    buffer.size = a.size;
    VK(vkCreateBuffer(g->device, &buffer, NULL, &a.buffer));
    vkGetBufferMemoryRequirements(g->device, a.buffer, &needs);
    memory.allocationSize = needs.size;
    memory.memoryTypeIndex = host_memory_type(g->physical, needs.memoryTypeBits);
    VK(vkAllocateMemory(g->device, &memory, NULL, &a.memory));
    VK(vkBindBufferMemory(g->device, a.buffer, a.memory, 0));
    VK(vkMapMemory(g->device, a.memory, 0, VK_WHOLE_SIZE, 0, &mapped));
    a.mapped = (char *)mapped;
    memset(a.mapped, 0xFF, (size_t)a.size);     /* NaN wherever nobody writes */
    bind_arena(g, &a);
    return a;
}

static void free_arena(const gpu *g, arena *a)
{
    vkDestroyBuffer(g->device, a->buffer, NULL);
    vkFreeMemory(g->device, a->memory, NULL);
}

static void upload(const arena *a, enum binding binding, const void *data, size_t size)
{
    if (size) memcpy(a->mapped + a->at[binding].offset, data, size);
}

static void upload_table(const arena *a, enum binding binding, const psurf_table *table)
{
    upload(a, binding, table->data, (size_t)table->count * table->stride);
}

static void upload_inputs(const arena *a, const scene *s)
{
    upload_table(a, RINGS, &s->tables.rings);
    upload_table(a, SPOKES, &s->tables.spokes);
    upload_table(a, CORNERS, &s->tables.corners);
    upload_table(a, FACETS, &s->tables.facets);
    upload_table(a, TRIG, &s->tables.trig);
    upload_table(a, BLENDS, &s->tables.blends);
    upload_table(a, FACE_FACET, &s->tables.face_facet);
    upload(a, POSITIONS, s->mesh->positions, s->mesh->vertex_count * sizeof s->mesh->positions[0]);
    upload(a, SAMPLES, s->samples, s->sample_count * sizeof *s->samples);
}

/* ---- running passes -------------------------------------------------------------------------- */

static void dispatch(const gpu *g, const scene *s, enum pass pass, uint32_t count)
{
    const VkMemoryBarrier barrier = {
        TYPE(MEMORY_BARRIER), .srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT,
        .dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_HOST_READ_BIT };
    push_constants push;
    push.count = count;
    push.blend_count = s->tables.blends.count;
    memcpy(push.kind_first, s->tables.kind_first, sizeof push.kind_first);
    memcpy(push.kind_first_corner, s->tables.kind_first_corner, sizeof push.kind_first_corner);
    vkCmdBindPipeline(g->commands, VK_PIPELINE_BIND_POINT_COMPUTE, g->pipelines[pass]);
    vkCmdPushConstants(g->commands, g->layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof push, &push);
    vkCmdDispatch(g->commands, (count + 63) / 64, 1, 1);
    vkCmdPipelineBarrier(g->commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                         VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_HOST_BIT, 0,
                         1, &barrier, 0, NULL, 0, NULL);
}

/* Evaluates the samples, after constructing the patches if asked for, and waits. */
static void run_passes(const gpu *g, const scene *s, int construct)
{
    const VkCommandBufferBeginInfo begin = {
        TYPE(COMMAND_BUFFER_BEGIN_INFO), .flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT };
    const VkSubmitInfo submit = {
        TYPE(SUBMIT_INFO), .commandBufferCount = 1, .pCommandBuffers = &g->commands };
    VK(vkBeginCommandBuffer(g->commands, &begin));
    vkCmdBindDescriptorSets(g->commands, VK_PIPELINE_BIND_POINT_COMPUTE, g->layout, 0, 1, &g->set,
                            0, NULL);
    if (construct) {
        dispatch(g, s, VERTICES, s->tables.rings.count);
        dispatch(g, s, BICUBIC_FACETS, s->patches.layout.kind[PSURF_BICUBIC].count);
        dispatch(g, s, P4_FACETS, s->patches.layout.kind[PSURF_P4].count);
    }
    dispatch(g, s, EVALUATE, s->sample_count);
    VK(vkEndCommandBuffer(g->commands));
    VK(vkQueueSubmit(g->queue, 1, &submit, VK_NULL_HANDLE));
    VK(vkQueueWaitIdle(g->queue));
}

/* ---- comparing ------------------------------------------------------------------------------- */

static int failures;

static void report(const char *what, double largest, double tolerance)
{
    int good = largest <= tolerance;
    printf("    %-24s %.2e%s\n", what, largest, good ? "" : "  FAILED");
    failures += !good;
}

/* Largest difference; NaN counts as infinite. */
static double difference(const float *a, const float *b, size_t count)
{
    double largest = 0;
    size_t i;
    for (i = 0; i < count; i++) {
        double d = fabs((double)a[i] - (double)b[i]);
        if (!(d <= largest)) largest = d >= 0 ? d : HUGE_VAL;
    }
    return largest;
}

static void compare_array(const arena *a, enum binding binding, const char *what,
                          const void *expected)
{
    const VkDescriptorBufferInfo *at = &a->at[binding];
    const float *made = (const float *)(const void *)(a->mapped + at->offset);
    report(what, difference(made, (const float *)expected, (size_t)at->range / 4) / CELLS,
           position_tolerance);
}

static void compare_construction(const arena *a, const scene *s)
{
    const psurf_patches_layout *l = &s->patches.layout;
    const char *scratch = (const char *)s->patches.scratch;
    const char *patches = (const char *)s->patches.patches;
    printf("  vertices and facets constructed by the device\n");
    compare_array(a, LIMITS, "limit points", scratch + l->limit_offset);
    compare_array(a, SPOKE_POINTS, "tangent and face points", scratch + l->spoke_offset);
    compare_array(a, BICUBIC_BLOCK, "bicubic patches", patches + l->kind[PSURF_BICUBIC].offset);
    compare_array(a, P4_BLOCK, "P4 patches", patches + l->kind[PSURF_P4].offset);
}

static void compare_points(const arena *a, const scene *s, const char *what)
{
    const float *result = (const float *)(const void *)(a->mapped + a->at[RESULT].offset);
    double position = 0, normal = 0;
    uint32_t i, cracks = 0, pairs = (s->sample_count - s->pair_first) / 2;
    for (i = 0; i < s->sample_count; i++) {
        double dp = difference(result + 6 * i, s->p + 3 * i, 3) / CELLS;
        double dn = difference(result + 6 * i + 3, s->n + 3 * i, 3);
        if (dp > position) position = dp;
        if (dn > normal) normal = dn;
    }
    for (i = s->pair_first; i < s->sample_count; i += 2)
        cracks += memcmp(result + 6 * i, result + 6 * i + 6, 3 * sizeof(float)) != 0;
    printf("  %u points of patches constructed by the %s\n", (unsigned)s->sample_count, what);
    report("positions", position, position_tolerance);
    report("normals", normal, normal_tolerance);
    printf("    %u of %u pairs on shared edges differ in a bit%s\n", (unsigned)cracks,
           (unsigned)pairs, cracks ? "  FAILED" : "");
    failures += cracks != 0;
}

static void try_scene(const gpu *g, const scene *s)
{
    const psurf_patches_layout *l = &s->patches.layout;
    arena a = make_arena(g, s);
    printf("  %s: %u bicubic, %u P4 patches\n", s->name, (unsigned)l->kind[PSURF_BICUBIC].count,
           (unsigned)l->kind[PSURF_P4].count);
    upload_inputs(&a, s);
    memcpy(a.mapped + a.scratch, s->patches.scratch, l->scratch_bytes);
    memcpy(a.mapped + a.patches, s->patches.patches, l->patch_bytes);
    run_passes(g, s, 0);
    compare_points(&a, s, "library");
    memset(a.mapped + a.scratch, 0xFF, l->scratch_bytes);
    memset(a.mapped + a.patches, 0xFF, l->patch_bytes);
    memset(a.mapped + a.at[RESULT].offset, 0xFF, a.at[RESULT].range);
    run_passes(g, s, 1);
    compare_construction(&a, s);
    compare_points(&a, s, "device");
    free_arena(g, &a);
}

/* ---- all of it ------------------------------------------------------------------------------- */

static uint32_t *read_code(const char *path, size_t *size)
{
    FILE *f = fopen(path, "rb");
    uint32_t *code;
    long length = 0;
    require(f != NULL, "cannot open the SPIR-V file");
    require(!fseek(f, 0, SEEK_END) && (length = ftell(f)) > 0 && !fseek(f, 0, SEEK_SET),
            "cannot read the SPIR-V file");
    *size = (size_t)length;
    code = (uint32_t *)allocate(*size);
    require(fread(code, 1, *size, f) == *size, "cannot read the SPIR-V file");
    fclose(f);
    return code;
}

/* Runs both scenes on every device that computes; returns how many there are. */
static int try_devices(const vulkan *vk, const scene scenes[2], const uint32_t *code, size_t size)
{
    VkPhysicalDevice physical[16];
    uint32_t i, count = 16;
    int tried = 0;
    if (vkEnumeratePhysicalDevices(vk->instance, &count, physical) < 0) return 0;
    for (i = 0; i < count; i++) {
        uint32_t family = compute_family(physical[i]);
        VkPhysicalDeviceProperties properties;
        gpu g;
        vkGetPhysicalDeviceProperties(physical[i], &properties);
        if (family == PSURF_NONE || properties.apiVersion < VK_API_VERSION_1_1 ||
            properties.limits.maxPerStageDescriptorStorageBuffers < BINDING_COUNT) {
            printf("%s: left out, too old or too small\n", properties.deviceName);
            continue;
        }
        printf("%s, validation layer %s\n", properties.deviceName,
               vk->validation ? "on" : "absent");
        g = open_gpu(physical[i], family, code, size);
        try_scene(&g, &scenes[0]);
        try_scene(&g, &scenes[1]);
        close_gpu(&g);
        tried++;
    }
    return tried;
}

int main(int argc, char **argv)
{
    vulkan vk;
    scene scenes[2];
    uint32_t *code;
    size_t code_size;
    mesh *m;
    int tried;
    if (argc != 2) {
        fprintf(stderr, "usage: vulkan_layouts SHADER.spv\n");
        return 1;
    }
    require(sizeof(psurf_real) == sizeof(float), "built with double: the GPU reads floats");
    memset(&vk, 0, sizeof vk);
    if (!open_vulkan(&vk)) {
        printf("skipped: there is no Vulkan driver\n");
        return 77;
    }
    code = read_code(argv[1], &code_size);
    m = make_mesh();
    scenes[0] = make_scene(m, "uniform blend ratios", 0);
    scenes[1] = make_scene(m, "random blend ratios", 1);
    tried = try_devices(&vk, scenes, code, code_size);
    close_vulkan(&vk);
    free_scene(&scenes[0]);
    free_scene(&scenes[1]);
    free(m);
    free(code);
    if (!tried) {
        printf("skipped: there is no Vulkan device\n");
        return 77;
    }
    if (message_count) printf("%d messages of the validation layer  FAILED\n", message_count);
    return failures || message_count ? 1 : 0;
}
