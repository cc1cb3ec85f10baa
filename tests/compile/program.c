/* The smallest whole program: a cube in, a smooth mesh out. Valid as C and as C++. */
#define PSURF_IMPLEMENTATION
#include <patchsurf.h>

#include <stdio.h>
#include <string.h>

int main(void)
{
    static const psurf_real positions[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                               {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    static const uint32_t faces[24] = {0, 3, 2, 1, 4, 5, 6, 7, 0, 1, 5, 4,
                                       1, 2, 6, 5, 2, 3, 7, 6, 3, 0, 4, 7};
    psurf_mesh_desc desc;
    psurf_smooth_mesh mesh;
    psurf_error error;
    int ok;

    memset(&desc, 0, sizeof desc);
    desc.vertex_count = 8;
    desc.face_count = 6;
    desc.uniform_size = 4;
    desc.face_vertices = faces;
    desc.positions = positions[0];
    if (psurf_smooth(&desc, 4, &mesh, &error) != PSURF_OK) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    ok = mesh.vertex_count == 98 && mesh.index_count == 6 * 16 * 2 * 3;
    printf("%lu vertices\n", (unsigned long)mesh.vertex_count);
    psurf_smooth_free(&mesh);
    return !ok;
}
