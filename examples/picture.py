#!/usr/bin/env python3
r"""Draws OBJ and GLB meshes side by side into one PNG picture. Needs Python 3 and nothing else.

A mesh with normals is shaded smoothly, one without is drawn with flat faces. The meshes of a
column share one camera, so that a control mesh and its surface can be compared. With --checker,
texture coordinates show as a pattern of squares. With --wire, tagged edges are drawn in red.

    build/patchsurf tessellate examples/meshes/axe.obj -o build/axe.obj
    python3 examples/picture.py axe.png examples/meshes/axe.obj build/axe.obj --wire
    python3 examples/picture.py axe.png build/axe.obj --size 1000 800 --azimuth 70 --elevation 5

The pictures of the sample meshes, control meshes above their surfaces (bash):

    for m in dodecahedra ball creature axe; do
        build/patchsurf tessellate examples/meshes/$m.obj -o build/$m.obj; done
    python3 examples/picture.py examples/meshes/gallery.png \
        examples/meshes/{dodecahedra,ball,creature,axe}.obj \
        build/{dodecahedra,ball,creature,axe}.obj \
        --columns 4 --size 1200 700 --azimuth 34 --wire --tint

    for m in axe_blend axe_hard hand rounded_cube pawn plate cloth; do
        build/patchsurf tessellate examples/meshes/$m.obj -o build/$m.obj; done
    python3 examples/picture.py examples/meshes/gallery2.png \
        examples/meshes/{axe_blend,axe_hard,hand,rounded_cube,pawn,plate,cloth}.obj \
        build/{axe_blend,axe_hard,hand,rounded_cube,pawn,plate,cloth}.obj \
        --columns 7 --widths 10 10 17 12 13 23 22 --size 1200 700 --azimuth 34 --wire --tint

    for s in pn smoothed_n hybrid png1 wm; do
        build/patchsurf tessellate examples/meshes/rounded_cube.obj -o build/$s.obj --scheme $s; done
    python3 examples/picture.py examples/meshes/schemes.png examples/meshes/rounded_cube.obj \
        build/{pn,smoothed_n,hybrid,png1,wm}.obj \
        --columns 6 --size 1200 230 --azimuth 34 --elevation 28 --tint

    build/patchsurf tessellate examples/meshes/cloth.obj -o build/cloth.glb
    python3 examples/picture.py examples/meshes/cloth.png build/cloth.glb --checker 16

The y axis points up; azimuth 0 and elevation 0 look at the mesh from the +z side.
"""
import argparse
import json
import math
import struct
import sys
import zlib

SUPERSAMPLING = 3               # samples per pixel and direction
MARGIN = 0.06                   # of a cell, on each side
CAMERA_DISTANCE = 5.0           # in bounding radii of a column's meshes
NORMAL_LEVELS = 256             # of the table that turns normals into colours; a power of two

# Lights in view coordinates (x right, y up, z to the eye): direction, strength, colour.
KEY_LIGHT = ((-0.50, 0.70, 0.51), 0.82, (1.00, 0.97, 0.92))
SHADOW_LIGHT = (-0.18, 0.95, 0.20)     # steeper than the key light: short shadows
FILL_LIGHT = ((0.85, 0.10, 0.40), 0.16, (0.80, 0.88, 1.00))
SKY_STRENGTH, SKY_COLOUR, GROUND_COLOUR = 0.34, (0.86, 0.93, 1.00), (0.80, 0.74, 0.68)
GLOSS, GLOSS_EXPONENT = 0.16, 36

SURFACE = "#e3a857"
CHECKER = "#f7efe0"                                     # every other square, with --checker
WIRE, TAGGED = "#2b2f3a", "#d1134f"
TINTS = {3: "#3fa796", 4: "#e8dcc3", 5: "#e2725b"}      # by corners of a face; more: the last
BACKGROUND = ("#fbfbfc", "#e6e9ee")                     # top and bottom of the picture

# Colours are linear light while they are computed. In a sample they are packed into one integer,
# 12 bits for each of red, green and blue in fields of 20 bits, below a count of covered samples:
# so the samples of a pixel are averaged by adding integers.
FULL = 4095
COVERED = 1 << 60


def linear(hex_colour):
    channels = (int(hex_colour[i:i + 2], 16) / 255 for i in (1, 3, 5))
    return tuple(c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in channels)


def to_byte(value):
    value = min(max(value, 0.0), 1.0)
    curve = value * 12.92 if value <= 0.0031308 else 1.055 * value ** (1 / 2.4) - 0.055
    return int(curve * 255 + 0.5)


def pack(colour):
    r, g, b = (int(min(c, 1.0) * FULL + 0.5) for c in colour)
    return COVERED | r << 40 | g << 20 | b


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return (a[0] / length, a[1] / length, a[2] / length) if length > 0 else (0.0, 0.0, 1.0)


# ---- meshes --------------------------------------------------------------------------------------

class Mesh:
    """What the file says, indices counted from 0."""

    def __init__(self):
        self.points, self.normals, self.places = [], [], []     # places: in the texture
        self.faces = []                         # lists of point indices
        self.face_normals = []                  # lists of normal indices, or None
        self.face_places = []                   # lists of place indices, or None
        self.tagged = set()                     # edges (a, b), a < b


def read_vector(words, size):
    vector = tuple(float(word) for word in words[1:size + 1])
    if len(vector) != size or not all(math.isfinite(x) for x in vector):
        raise ValueError(f"expected {size} finite numbers")
    return vector


def read_index(text, count):
    index = int(text)
    index = index - 1 if index > 0 else count + index
    if not 0 <= index < count:
        raise ValueError(f"index {text} is out of range, the file has {count} so far")
    return index


def read_face(mesh, words):
    corners = [word.split("/") for word in words]
    if len(corners) < 3:
        raise ValueError("face has fewer than 3 corners")
    mesh.faces.append([read_index(c[0], len(mesh.points)) for c in corners])
    if all(len(c) == 3 and c[2] for c in corners):
        mesh.face_normals.append([read_index(c[2], len(mesh.normals)) for c in corners])
    else:
        mesh.face_normals.append(None)
    if all(len(c) > 1 and c[1] for c in corners):
        mesh.face_places.append([read_index(c[1], len(mesh.places)) for c in corners])
    else:
        mesh.face_places.append(None)


def read_crease(mesh, counts, words):
    """The edges of a tag like: t crease 2/1/0 a b sharpness."""
    ends = [int(word) for word in words[:int(counts.split("/")[0])]]
    mesh.tagged.update((min(e), max(e)) for e in zip(ends[::2], ends[1::2]))


def read_obj(path):
    mesh = Mesh()
    with open(path, encoding="ascii", errors="replace") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            try:
                if not words:
                    continue
                if words[0] == "v":
                    mesh.points.append(read_vector(words, 3))
                elif words[0] == "vn":
                    mesh.normals.append(read_vector(words, 3))
                elif words[0] == "vt":
                    mesh.places.append(read_vector(words, 2))
                elif words[0] == "f":
                    read_face(mesh, words[1:])
                elif words[:2] == ["t", "crease"] and len(words) > 2:
                    read_crease(mesh, words[2], words[3:])
            except ValueError as error:
                raise ValueError(f"{path}:{number}: {error}") from None
    return mesh


def read_accessor(gltf, binary, number):
    """A list of numbers, or of tuples, from the binary chunk."""
    accessor = gltf["accessors"][number]
    view = gltf["bufferViews"][accessor["bufferView"]]
    if "sparse" in accessor or "uri" in gltf["buffers"][view["buffer"]]:
        raise ValueError("sparse accessors and external buffers are not read")
    letter = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
    size = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
    item = struct.Struct("<" + letter[accessor["componentType"]] * size)
    first = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", item.size)
    items = [item.unpack_from(binary, first + i * stride) for i in range(accessor["count"])]
    return [x for x, in items] if size == 1 else items


def read_primitive(mesh, gltf, binary, primitive):
    if primitive.get("mode", 4) != 4:
        raise ValueError("only triangles are read")
    attributes = primitive["attributes"]
    points = read_accessor(gltf, binary, attributes["POSITION"])
    indices = range(len(points))
    if "indices" in primitive:
        indices = read_accessor(gltf, binary, primitive["indices"])
    if any(i >= len(points) for i in indices):
        raise ValueError("index is out of range")
    faces = list(zip(indices[::3], indices[1::3], indices[2::3]))
    for name, values, lists in (("POSITION", mesh.points, mesh.faces),
                                ("NORMAL", mesh.normals, mesh.face_normals),
                                ("TEXCOORD_0", mesh.places, mesh.face_places)):
        if name not in attributes:
            lists += [None] * len(faces)
            continue
        base = len(values)
        values += read_accessor(gltf, binary, attributes[name])
        if len(values) != base + len(points):
            raise ValueError(f"{name} and POSITION have different counts")
        lists += [[base + i for i in face] for face in faces]


def read_glb(path):
    """All meshes of a binary glTF file, where they are without the transformations of nodes."""
    with open(path, "rb") as file:
        data = file.read()
    try:
        magic, version, _ = struct.unpack_from("<4sII", data)
        if magic != b"glTF" or version != 2:
            raise ValueError("not binary glTF 2")
        chunks, at = {}, 12
        while at < len(data):
            size, kind = struct.unpack_from("<I4s", data, at)
            chunks[kind] = data[at + 8:at + 8 + size]
            at += 8 + size
        gltf = json.loads(chunks[b"JSON"])
        if any(set(node) & {"matrix", "rotation", "scale", "translation"}
               for node in gltf.get("nodes", [])):
            raise ValueError("transformed nodes are not read")
        mesh = Mesh()
        for part in gltf["meshes"]:
            for primitive in part["primitives"]:
                read_primitive(mesh, gltf, chunks[b"BIN\0"], primitive)
    except (KeyError, IndexError, TypeError, struct.error) as error:
        raise ValueError(f"{path}: broken: {error!r}") from None
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None
    return mesh


def read_mesh(path):
    mesh = read_glb(path) if path.lower().endswith(".glb") else read_obj(path)
    if not mesh.faces:
        raise ValueError(f"{path}: no faces")
    return mesh


# ---- camera --------------------------------------------------------------------------------------

class Camera:
    """Looks at all the meshes of a column, and fits them into a cell of the picture."""

    def __init__(self, meshes, azimuth, elevation, width, height):
        a, e = math.radians(azimuth), math.radians(elevation)
        self.towards = (math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e))
        self.right = (math.cos(a), 0.0, -math.sin(a))
        self.up = cross(self.towards, self.right)
        points = [p for mesh in meshes for p in mesh.points]
        low = [min(p[k] for p in points) for k in range(3)]
        high = [max(p[k] for p in points) for k in range(3)]
        self.centre = tuple((low[k] + high[k]) / 2 for k in range(3))
        self.radius = max(math.dist(low, high) / 2, 1e-30)
        self.fit(points, width, height)

    def fit(self, points, width, height):
        self.scale, self.offset = 1.0, (0.0, 0.0)
        seen = [self.project(p) for p in points]
        left, right = min(p[0] for p in seen), max(p[0] for p in seen)
        top, bottom = min(p[1] for p in seen), max(p[1] for p in seen)
        room = 1 - 2 * MARGIN
        self.scale = room * min(width / max(right - left, 1e-9), height / max(bottom - top, 1e-9))
        self.offset = (width / 2 - self.scale * (left + right) / 2,
                       height / 2 - self.scale * (top + bottom) / 2)

    def turn(self, v):
        """A direction of the world in view coordinates."""
        return (dot(v, self.right), dot(v, self.up), dot(v, self.towards))

    def project(self, p):
        """Pixel coordinates, and 1/distance, which is linear on the screen."""
        c = self.centre
        x, y, z = self.turn(((p[0] - c[0]) / self.radius, (p[1] - c[1]) / self.radius,
                             (p[2] - c[2]) / self.radius))
        near = 1 / (CAMERA_DISTANCE - z)
        size = self.scale * near
        return (x * size + self.offset[0], self.offset[1] - y * size, near)

    def shadow(self, p, light, floor):
        """Where the light throws the shadow of p on a floor at this height."""
        t = (p[1] - floor) / light[1]
        return self.project((p[0] - t * light[0], floor, p[2] - t * light[2]))


# ---- light ---------------------------------------------------------------------------------------

def shade(n, albedo):
    """Linear colour of a surface with the unit normal n in view coordinates."""
    direction, strength, colour = KEY_LIGHT
    key = max(0.0, (dot(n, direction) + 0.15) / 1.15) * strength
    fill = max(0.0, dot(n, FILL_LIGHT[0])) * FILL_LIGHT[1]
    sky = 0.5 + 0.5 * n[1]
    half = unit((direction[0], direction[1], direction[2] + 1))
    shine = GLOSS * max(0.0, dot(n, half)) ** GLOSS_EXPONENT + 0.06 * (1 - max(n[2], 0.0)) ** 4
    return tuple(
        albedo[k] * (key * colour[k] + fill * FILL_LIGHT[2][k] + SKY_STRENGTH *
                     (sky * SKY_COLOUR[k] + (1 - sky) * GROUND_COLOUR[k])) + shine
        for k in range(3))


def shade_table(albedo):
    """Packed colours of all normals towards the eye, by their x and y: lights and camera are far
    enough away that nothing else counts."""
    table = []
    half = NORMAL_LEVELS / 2
    for j in range(NORMAL_LEVELS):
        y = (j + 0.5 - half) / (half - 1)
        for i in range(NORMAL_LEVELS):
            x = (i + 0.5 - half) / (half - 1)
            outside = max(math.hypot(x, y), 1.0)
            nx, ny = x / outside, y / outside
            nz = math.sqrt(max(0.0, 1 - nx * nx - ny * ny))
            table.append(pack(shade((nx, ny, nz), albedo)))
    return table


# ---- rasteriser ----------------------------------------------------------------------------------

class Raster:
    """Packed colours and a depth buffer of 1/distance; a larger value is nearer."""

    def __init__(self, width, height):
        self.width, self.height = width, height
        self.colour = [0] * (width * height)
        self.depth = [0.0] * (width * height)

    def spans(self, a, b, c):
        """Yields (y, first, last + 1) of the pixels whose centres are in a triangle."""
        a, b, c = sorted((a, b, c), key=lambda p: p[1])
        (ax, ay), (bx, by), (cx, cy) = a[:2], b[:2], c[:2]
        first, end = max(math.ceil(ay - 0.5), 0), min(math.ceil(cy - 0.5), self.height)
        if first >= end:
            return
        ac = (cx - ax) / (cy - ay)
        ab = (bx - ax) / (by - ay) if by > ay else 0.0
        bc = (cx - bx) / (cy - by) if cy > by else 0.0
        for y in range(first, end):
            middle = y + 0.5
            left = ax + (middle - ay) * ac
            right = ax + (middle - ay) * ab if middle < by else bx + (middle - by) * bc
            if left > right:
                left, right = right, left
            i, j = max(math.ceil(left - 0.5), 0), min(math.ceil(right - 0.5), self.width)
            if i < j:
                yield y, i, j

    def flat(self, a, b, c, colour):
        """A triangle of points (x, y, 1/distance) in one colour."""
        slope = gradient(a, b, c, 2)
        if slope is None:
            return
        dx, dy, z0 = slope
        depth, pixels, width = self.depth, self.colour, self.width
        for y, i, j in self.spans(a, b, c):
            z = z0 + i * dx + y * dy
            for k in range(y * width + i, y * width + j):
                if z > depth[k]:
                    depth[k] = z
                    pixels[k] = colour
                z += dx

    def smooth(self, a, b, c, table):
        """A triangle of points (x, y, 1/distance, normal x, normal y), coloured by a table."""
        slope = gradient(a, b, c, 2)
        if slope is None:
            return
        dx, dy, z0 = slope
        udx, udy, u0 = gradient(a, b, c, 3)
        vdx, vdy, v0 = gradient(a, b, c, 4)
        depth, pixels, width, levels = self.depth, self.colour, self.width, NORMAL_LEVELS
        mask = levels - 1                       # slivers may overshoot: stay in the table
        for y, i, j in self.spans(a, b, c):
            z = z0 + i * dx + y * dy
            u = u0 + i * udx + y * udy
            v = v0 + i * vdx + y * vdy
            for k in range(y * width + i, y * width + j):
                if z > depth[k]:
                    depth[k] = z
                    pixels[k] = table[(int(v) & mask) * levels + (int(u) & mask)]
                z += dx
                u += udx
                v += vdx

    def checkered(self, a, b, c, tables):
        """As smooth(), of points with the place in the texture behind the normal; squares of side 1
        are coloured by one table and the other in turn."""
        slope = gradient(a, b, c, 2)
        if slope is None:
            return
        dx, dy, z0 = slope
        udx, udy, u0 = gradient(a, b, c, 3)
        vdx, vdy, v0 = gradient(a, b, c, 4)
        sdx, sdy, s0 = gradient(a, b, c, 5)
        tdx, tdy, t0 = gradient(a, b, c, 6)
        depth, pixels, width, levels = self.depth, self.colour, self.width, NORMAL_LEVELS
        mask = levels - 1
        for y, i, j in self.spans(a, b, c):
            for x in range(i, j):
                k = y * width + x
                z = z0 + x * dx + y * dy
                if z > depth[k]:
                    depth[k] = z
                    u, v = int(u0 + x * udx + y * udy) & mask, int(v0 + x * vdx + y * vdy) & mask
                    odd = math.floor(s0 + x * sdx + y * sdy) + math.floor(t0 + x * tdx + y * tdy)
                    pixels[k] = tables[odd & 1][v * levels + u]

    def line(self, a, b, thickness, colour):
        """A thick line, a little nearer than the faces it lies on."""
        dx, dy = b[0] - a[0], b[1] - a[1]
        length = math.hypot(dx, dy)
        if length == 0:
            return
        nx, ny = -dy / length * thickness / 2, dx / length * thickness / 2
        za, zb = a[2] * 1.004, b[2] * 1.004
        corners = ((a[0] + nx, a[1] + ny, za), (a[0] - nx, a[1] - ny, za),
                   (b[0] - nx, b[1] - ny, zb), (b[0] + nx, b[1] + ny, zb))
        self.flat(corners[0], corners[1], corners[2], colour)
        self.flat(corners[0], corners[2], corners[3], colour)


def gradient(a, b, c, k):
    """Slopes of value k of three points over the screen, and its value at the centre of pixel 0."""
    abx, aby, acx, acy = b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]
    area = abx * acy - acx * aby
    if abs(area) < 1e-9:                        # covers no pixel's centre
        return None
    dx = ((b[k] - a[k]) * acy - (c[k] - a[k]) * aby) / area
    dy = ((c[k] - a[k]) * abx - (b[k] - a[k]) * acx) / area
    return dx, dy, a[k] + (0.5 - a[0]) * dx + (0.5 - a[1]) * dy


# ---- one mesh ------------------------------------------------------------------------------------

def face_normal(mesh, face):
    """Newell's normal of a polygon, planar or not."""
    n = [0.0, 0.0, 0.0]
    for i, vertex in enumerate(face):
        p, q = mesh.points[face[i - 1]], mesh.points[vertex]
        n[0] += (p[1] - q[1]) * (p[2] + q[2])
        n[1] += (p[2] - q[2]) * (p[0] + q[0])
        n[2] += (p[0] - q[0]) * (p[1] + q[1])
    return unit(n)


def draw_flat(raster, mesh, screen, camera, albedo_of_size):
    for face, normals, places in zip(mesh.faces, mesh.face_normals, mesh.face_places):
        if normals is not None or places is not None:
            continue
        n = camera.turn(face_normal(mesh, face))
        if n[2] < 0:                            # seen from inside; hidden unless the mesh is open
            n = (-n[0], -n[1], -n[2])
        albedo = albedo_of_size[min(max(len(face), 3), 5)]
        colour = pack(shade(n, albedo))
        for i in range(1, len(face) - 1):
            raster.flat(screen[face[0]], screen[face[i]], screen[face[i + 1]], colour)


def seen_from_outside(corners):
    return sum(p[0] * q[1] - q[0] * p[1] for p, q in zip(corners, corners[1:] + corners[:1])) < 0


def table_places(corners, normals):
    """Where the unit normals, in view coordinates, of a face are in a shade table."""
    half = NORMAL_LEVELS / 2
    outside = seen_from_outside(corners)
    places = []
    for x, y, z in normals:
        # The inside of an open mesh is lit as if it were the outside of another.
        reach = half - 1 if outside or z >= 0 else 1 - half
        places.append((half + reach * x, half + reach * y))
    return places


def draw_smooth(raster, mesh, screen, camera, table):
    turned = [camera.turn(unit(n)) for n in mesh.normals]
    for face, normals, places in zip(mesh.faces, mesh.face_normals, mesh.face_places):
        if normals is None or places is not None:
            continue
        corners = [screen[p] for p in face]
        colours = table_places(corners, [turned[n] for n in normals])
        corners = [corner + colour for corner, colour in zip(corners, colours)]
        for i in range(1, len(face) - 1):
            raster.smooth(corners[0], corners[i], corners[i + 1], table)


def draw_checkered(raster, mesh, screen, camera, tables, squares):
    """The faces with texture coordinates, with normals or flat."""
    turned = [camera.turn(unit(n)) for n in mesh.normals]
    for face, normals, places in zip(mesh.faces, mesh.face_normals, mesh.face_places):
        if places is None:
            continue
        if normals is None:
            shaded = [camera.turn(face_normal(mesh, face))] * len(face)
        else:
            shaded = [turned[n] for n in normals]
        corners = [screen[p] for p in face]
        corners = [corner + colour + tuple(squares * x for x in mesh.places[place])
                   for corner, colour, place in zip(corners, table_places(corners, shaded), places)]
        for i in range(1, len(face) - 1):
            raster.checkered(corners[0], corners[i], corners[i + 1], tables)


def draw_wire(raster, mesh, screen, thickness):
    """The edges of faces without normals, where they bound a face seen from outside, or one face
    only. (Lines are nearer than faces: edges just behind the horizon would shine through.)"""
    colour, tagged = pack(linear(WIRE)), pack(linear(TAGGED))
    users, visible = {}, set()
    for face, normals in zip(mesh.faces, mesh.face_normals):
        if normals is not None:
            continue
        edges = [(min(p, q), max(p, q)) for p, q in zip(face, face[1:] + face[:1])]
        for edge in edges:
            users[edge] = users.get(edge, 0) + 1
        if seen_from_outside([screen[p] for p in face]):
            visible.update(edges)
    for (p, q), count in users.items():
        if (p, q) in mesh.tagged and (p, q) in visible:
            raster.line(screen[p], screen[q], 2 * thickness, tagged)
        elif count == 1 or (p, q) in visible:
            raster.line(screen[p], screen[q], thickness, colour)


def box_blur(rows, radius):
    """Mean over squares of side 2*radius+1, the borders repeated."""
    def blur(row):
        padded = [row[0]] * (radius + 1) + row + [row[-1]] * radius
        total, sums = 0.0, []
        for value in padded:
            total += value
            sums.append(total)
        side = 2 * radius + 1
        return [(b - a) / side for a, b in zip(sums, sums[side:])]
    return [list(r) for r in zip(*(blur(list(c)) for c in zip(*(blur(row) for row in rows))))]


def fade(size):
    """Factors that let a shadow end softly before the border of its cell cuts it off."""
    border = 0.12 * size
    return [min(1.0, (x + 0.5) / border, (size - x - 0.5) / border) for x in range(size)]


def floor_shadow(mesh, camera, width, height):
    """How dark the floor is, 0..1, per pixel: a planar shadow, blurred."""
    d = SHADOW_LIGHT
    light = unit([d[0] * camera.right[k] + d[1] * camera.up[k] + d[2] * camera.towards[k]
                  for k in range(3)])
    if light[1] < 0.1:                          # seen from below: there is no floor
        return [[0.0] * width for _ in range(height)]
    raster = Raster(width, height)
    floor = min(p[1] for p in mesh.points)
    fallen = [camera.shadow(p, light, floor) for p in mesh.points]
    for face in mesh.faces:
        for i in range(1, len(face) - 1):
            raster.flat(fallen[face[0]], fallen[face[i]], fallen[face[i + 1]], 1)
    rows = [[float(c) for c in raster.colour[y * width:(y + 1) * width]] for y in range(height)]
    radius = max(1, min(width, height) // 60)
    rows = box_blur(box_blur(rows, radius), radius)
    across, down = fade(width), fade(height)
    return [[value * f * g for value, f in zip(row, across)] for row, g in zip(rows, down)]


def occlusion(raster, width, height):
    """Light that reaches each pixel, from the depth buffer alone: what lies behind the mean depth
    around it is in a hollow, or behind something, and gets darker."""
    s, w = SUPERSAMPLING, raster.width
    depth = [raster.depth[(y * s + s // 2) * w + s // 2:(y * s + s // 2) * w + w:s]
             for y in range(height)]
    distance = [[1 / z if z else 0.0 for z in row] for row in depth]
    cover = [[1.0 if z else 0.0 for z in row] for row in depth]
    result = [[1.0] * width for _ in range(height)]
    for radius, strength in ((min(width, height) // 16, 1.3), (min(width, height) // 48, 2.0)):
        radius = max(radius, 1)
        total = box_blur(box_blur(distance, radius), radius)
        weight = box_blur(box_blur(cover, radius), radius)
        for y in range(height):
            row = result[y]
            for x, d in enumerate(distance[y]):
                if d:
                    behind = d - total[y][x] / weight[y][x]
                    if behind > 0:
                        row[x] *= 1 - 0.5 * min(strength * behind, 0.55)
    return result


def background(row, rows):
    """Linear colour behind a row of the picture."""
    top, bottom = (linear(c) for c in BACKGROUND)
    t = row / max(rows - 1, 1)
    return [top[k] + (bottom[k] - top[k]) * t for k in range(3)]


def resolve(raster, light, shadow, backs):
    """Averages samples, lays them over the background colours of the rows; rows of bytes."""
    s = SUPERSAMPLING
    full = s * s * FULL
    mask = (1 << 20) - 1
    curve = [to_byte(i / 4095) for i in range(4096)]
    rows = []
    for y, colour in enumerate(backs):
        w = raster.width
        lines = [raster.colour[(y * s + k) * w:(y * s + k + 1) * w] for k in range(s)]
        sums = [sum(column) for column in zip(*lines)]
        sums = [sum(group) for group in zip(*(sums[k::s] for k in range(s)))]
        back = [c * FULL for c in colour]
        row = bytearray()
        for x, total in enumerate(sums):
            bare = (s * s - (total >> 60)) * (1 - 0.42 * shadow[y][x])
            lit = light[y][x]
            for k in range(3):
                value = (total >> (40 - 20 * k) & mask) * lit + back[k] * bare
                row.append(curve[int(value * 4095 / full)])
        rows.append(row)
    return rows


def draw(mesh, camera, backs, width, height, options):
    """One cell of the picture, as rows of red, green and blue bytes."""
    raster = Raster(width * SUPERSAMPLING, height * SUPERSAMPLING)
    screen = []
    for p in mesh.points:
        x, y, near = camera.project(p)
        screen.append((x * SUPERSAMPLING, y * SUPERSAMPLING, near))
    surface = linear(options.colour)
    albedo = {n: linear(TINTS[n]) if options.tint else surface for n in TINTS}
    draw_flat(raster, mesh, screen, camera, albedo)
    table = shade_table(surface)
    draw_smooth(raster, mesh, screen, camera, table)
    draw_checkered(raster, mesh, screen, camera, (shade_table(linear(CHECKER)), table),
                   options.checker)
    light = occlusion(raster, width, height)
    if options.wire:
        draw_wire(raster, mesh, screen, SUPERSAMPLING * 1.2)
    shadow = floor_shadow(mesh, camera, width, height)
    return resolve(raster, light, shadow, backs)


# ---- the picture ---------------------------------------------------------------------------------

def filtered(row, above):
    """A row of bytes behind the PNG filter (sub, up or Paeth) that suits it best."""
    left = bytes(3) + row[:-3]
    corner = bytes(3) + above[:-3]
    paeth = bytearray()
    for value, a, b, c in zip(row, left, above, corner):
        pa, pb, pc = abs(b - c), abs(a - c), abs(a + b - 2 * c)
        paeth.append((value - (a if pa <= pb and pa <= pc else b if pb <= pc else c)) & 255)
    candidates = ((1, bytes((v - a) & 255 for v, a in zip(row, left))),
                  (2, bytes((v - b) & 255 for v, b in zip(row, above))),
                  (4, bytes(paeth)))
    best = min(candidates, key=lambda c: sum(v if v < 128 else 256 - v for v in c[1]))
    return bytes([best[0]]) + best[1]


def write_png(path, width, rows):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    above = bytes(3 * width)
    data = bytearray()
    for row in rows:
        data += filtered(row, above)
        above = row
    header = struct.pack(">IIBBBBB", width, len(rows), 8, 2, 0, 0, 0)
    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                  chunk(b"IDAT", zlib.compress(bytes(data), 9)) + chunk(b"IEND", b""))


def picture(meshes, options):
    """Draws the meshes row by row; the columns of a row lie side by side."""
    columns = options.columns or len(meshes)
    lines = -(-len(meshes) // columns)
    width, height = options.size
    shares = options.widths or [1] * columns
    if len(shares) != columns:
        raise ValueError(f"--widths takes {columns} numbers, one a column")
    xs = [width * sum(shares[:i]) // sum(shares) for i in range(columns + 1)]
    ys = [height * j // lines for j in range(lines + 1)]
    if min(b - a for cuts in (xs, ys) for a, b in zip(cuts, cuts[1:])) < 16:
        raise ValueError("the picture is too small for so many meshes")
    backs = [background(y, height) for y in range(height)]
    rows = []
    for j in range(lines):
        band = [bytearray() for _ in range(ys[j], ys[j + 1])]
        for i in range(columns):
            w, h = xs[i + 1] - xs[i], ys[j + 1] - ys[j]
            column = meshes[i::columns]
            if j < len(column):
                camera = Camera(column, options.azimuth, options.elevation, w, h)
                cell = draw(column[j], camera, backs[ys[j]:ys[j + 1]], w, h, options)
            else:
                cell = [bytes(to_byte(c) for c in back) * w for back in backs[ys[j]:ys[j + 1]]]
            for line, part in zip(band, cell):
                line += part
        rows += band
    return rows


def hex_colour(text):
    if len(text) != 7 or text[0] != "#" or any(c not in "0123456789abcdefABCDEF" for c in text[1:]):
        raise argparse.ArgumentTypeError(f"{text} is not a colour like #e3a857")
    return text


def positive(text):
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a positive number")
    return value


def read_options():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.png")
    parser.add_argument("meshes", metavar="MESH", nargs="+", help="Wavefront OBJ or binary glTF")
    parser.add_argument("--columns", type=positive, metavar="N",
                        help="meshes side by side before the next row begins (default: all)")
    parser.add_argument("--widths", type=positive, metavar="N", nargs="+",
                        help="relative widths of the columns (default: all the same)")
    parser.add_argument("--size", type=positive, nargs=2, metavar=("W", "H"), default=(640, 480),
                        help="of the whole picture (default: 640 480)")
    parser.add_argument("--azimuth", type=float, metavar="DEG", default=30.0,
                        help="turns the camera around the y axis (default: 30)")
    parser.add_argument("--elevation", type=float, metavar="DEG", default=20.0,
                        help="raises the camera (default: 20)")
    parser.add_argument("--wire", action="store_true",
                        help="draw the edges of faces that have no normals")
    parser.add_argument("--tint", action="store_true",
                        help="colour faces that have no normals by their number of corners")
    parser.add_argument("--checker", type=positive, metavar="N",
                        help="squares on faces with texture coordinates, N across the texture")
    parser.add_argument("--colour", type=hex_colour, metavar="#RRGGBB", default=SURFACE,
                        help=f"of everything else (default: {SURFACE})")
    return parser.parse_args()


def main():
    options = read_options()
    try:
        meshes = [read_mesh(path) for path in options.meshes]
        if not options.checker:
            for mesh in meshes:
                mesh.face_places = [None] * len(mesh.faces)
        rows = picture(meshes, options)
        write_png(options.out, options.size[0], rows)
    except (OSError, ValueError) as error:
        print(f"picture.py: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
