#!/usr/bin/env python3
"""End-to-end test of the command-line tool.

    python3 tests/test_tool.py build/patchsurf [unittest arguments]

Runs the tool on small meshes made here and judges what it prints and writes: against the interface
that its --help describes, and against values computed here from the mesh alone.
"""

import itertools
import json
import math
import os
import pty
import random
import re
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree
from collections import Counter

import check_cracks
import count_mesh

TOOL = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else "build/patchsurf"
COMMANDS = ("info", "tessellate", "patches", "sample", "check")    # and report, which needs no mesh
SCHEMES = ("pm", "pn", "smoothed_n", "hybrid", "png1", "wm", "cubic_wm_b1", "cubic_pn_b1",
           "cubic_wm_b2", "cubic_pn_b2")


# ---- meshes: (vertices, faces), faces count from 0 -----------------------------------------------

def torus(columns, rows):
    turn = lambda i, n: (math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n))
    vertices = []
    for i, j in itertools.product(range(columns), range(rows)):
        (c, s), (d, z) = turn(i, columns), turn(j, rows)
        vertices.append((c * (2 + d), s * (2 + d), z))
    at = lambda i, j: i % columns * rows + j % rows
    return vertices, [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
                      for i in range(columns) for j in range(rows)]


def ball(columns, rows):
    vertices = [(0, 0, -1)]
    for j in range(1, rows):
        z, r = -math.cos(math.pi * j / rows), math.sin(math.pi * j / rows)
        vertices += [(r * math.cos(2 * math.pi * i / columns),
                      r * math.sin(2 * math.pi * i / columns), z) for i in range(columns)]
    vertices.append((0, 0, 1))
    at = lambda i, j: 1 + (j - 1) * columns + i % columns
    faces = [(0, at(i + 1, 1), at(i, 1)) for i in range(columns)]
    faces += [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
              for j in range(1, rows - 1) for i in range(columns)]
    faces += [(at(i, rows - 1), at(i + 1, rows - 1), len(vertices) - 1) for i in range(columns)]
    return vertices, faces


def prism(corners):
    ring = [(math.cos(2 * math.pi * i / corners), math.sin(2 * math.pi * i / corners))
            for i in range(corners)]
    vertices = [(x, y, -0.5) for x, y in ring] + [(x, y, 0.5) for x, y in ring]
    faces = [tuple(reversed(range(corners))), tuple(range(corners, 2 * corners))]
    faces += [(i, (i + 1) % corners, (i + 1) % corners + corners, i + corners)
              for i in range(corners)]
    return vertices, faces


def house():
    """A pentagonal prism, one quad of which is cut in two: triangles, quads, pentagons."""
    vertices, faces = prism(5)
    a, b, c, d = faces.pop()
    return vertices, faces + [(a, b, c), (a, c, d)]


CUBE = ([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)],
        [(2, 0, 1, 3), (1, 0, 4, 5), (4, 0, 2, 6), (3, 1, 5, 7), (6, 2, 3, 7), (5, 4, 6, 7)])
CUBE_EDGES = sorted({tuple(sorted((f[i - 1], f[i]))) for f in CUBE[1] for i in range(4)})
OCTAHEDRON = ([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
              [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4),
               (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])


# Two triangles and two quads back to back, so that all their vertices have two edges.
PILLOWS = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0), (3, 1, 1)],
           [(0, 1, 2), (2, 1, 0), (3, 4, 5, 6), (6, 5, 4, 3)])


def grid(columns, rows):
    """An open sheet of quads."""
    vertices = [(i, j, 0.1 * i * j) for i in range(columns + 1) for j in range(rows + 1)]
    at = lambda i, j: i * (rows + 1) + j
    return vertices, [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
                      for i in range(columns) for j in range(rows)]


def jitter(mesh, seed=1, size=0.1):
    rng = random.Random(seed)
    return [tuple(x + rng.uniform(-size, size) for x in p) for p in mesh[0]], mesh[1]


def moved(mesh, by):
    return [tuple(x + t for x, t in zip(p, by)) for p in mesh[0]], mesh[1]


def about_origin(mesh):
    """The middle of its box at the origin, coordinates with 11 binary places: exact when moved."""
    vertices = [tuple(round(1024 * x) / 1024 for x in p) for p in mesh[0]]
    return moved((vertices, mesh[1]), [-(min(x) + max(x)) / 2 for x in zip(*vertices)])


def obj(mesh, extra=""):
    lines = ["v %r %r %r" % tuple(map(float, p)) for p in mesh[0]]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in mesh[1]]
    return "\n".join(lines) + "\n" + extra


def icosahedron():
    """Inscribed in the unit sphere, seen from outside counter-clockwise."""
    golden = (1 + math.sqrt(5)) / 2
    turned = [(0, a, b * golden) for a in (1, -1) for b in (1, -1)]
    turned += [p[1:] + p[:1] for p in turned] + [p[2:] + p[:2] for p in turned]
    vertices = [unit(p) for p in turned]
    faces = []
    for a, b, c in itertools.combinations(range(12), 3):
        p, q, r = (vertices[k] for k in (a, b, c))
        if max(math.dist(p, q), math.dist(q, r), math.dist(r, p)) < 1.1:
            faces.append((a, b, c) if dot(cross(minus(q, p), minus(r, p)), p) > 0 else (a, c, b))
    assert len(faces) == 20
    return vertices, faces


def flat_torus(size):
    """The torus of the papers: radii 1 and 1/2, size x size quads from the inner equator on."""
    vertices = []
    for i, j in itertools.product(range(size), repeat=2):
        a, b = 2 * math.pi * i / size, math.pi + 2 * math.pi * j / size
        r = 1 + math.cos(b) / 2
        vertices.append((r * math.cos(a), r * math.sin(a), math.sin(b) / 2))
    at = lambda i, j: i % size * size + j % size
    return vertices, [(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1))
                      for i in range(size) for j in range(size)]


def halves(mesh):
    """Every quad cut in two."""
    return mesh[0], [t for a, b, c, d in mesh[1] for t in ((a, b, c), (a, c, d))]


def minus(p, q):
    return tuple(x - y for x, y in zip(p, q))


def dot(p, q):
    return sum(x * y for x, y in zip(p, q))


def unit(p):
    return tuple(x / math.sqrt(dot(p, p)) for x in p)


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def combine(*terms):
    """Sum of weight, point, weight, point ..."""
    return tuple(sum(w * p[k] for w, p in zip(terms[::2], terms[1::2])) for k in range(3))


def flat_normal(mesh, face):
    """Newell's, of length twice the area."""
    corners = [mesh[0][v] for v in mesh[1][face]]
    return tuple(map(sum, zip(*(cross(p, q) for p, q in zip(corners, corners[1:] + corners[:1])))))


def mean_normals(mesh, by_area=False):
    """Per vertex: the mean of the faces' unit normals, or of their normals by area."""
    sums = [(0, 0, 0)] * len(mesh[0])
    for f, face in enumerate(mesh[1]):
        n = flat_normal(mesh, f)
        for v in face:
            sums[v] = combine(1, sums[v], 1, n if by_area else unit(n))
    return [unit(n) if any(n) else n for n in sums]


def obj_normals(mesh, normal_of, extra=""):
    """normal_of(face number, corner number) gives the normal of a face corner, or None."""
    lines = ["v %r %r %r" % tuple(map(float, p)) for p in mesh[0]]
    known = {}
    for f, face in enumerate(mesh[1]):
        line = "f"
        for i, v in enumerate(face):
            n = normal_of(f, i)
            if n is None:
                line += " %d" % (v + 1)
                continue
            if n not in known:
                known[n] = len(known) + 1
                lines.append("vn %r %r %r" % tuple(map(float, n)))
            line += " %d//%d" % (v + 1, known[n])
        lines.append(line)
    return "\n".join(lines) + "\n" + extra


def creases(edges, sharpness=10):
    return "".join("t crease 2/1/0 %d %d %s\n" % (*sorted(e), sharpness) for e in edges)


def ply(mesh, form="ascii", coordinate="float", count="uchar", index="int",
        vertex_names="x y z", list_name="vertex_indices", extra=lambda v: (), line_break="\n"):
    """vertex_names: of all properties, those beyond z given by extra(vertex number)."""
    letters = dict(float="f", float32="f", double="d", float64="d", char="b", int8="b", uchar="B",
                   uint8="B", short="h", int16="h", ushort="H", uint16="H", int="i", int32="i",
                   uint="I", uint32="I")
    lines = ["ply", "format %s 1.0" % form, "comment end_header element face 7", "obj_info none",
             "element vertex %d" % len(mesh[0])]
    lines += ["property %s %s" % (coordinate, name) for name in vertex_names.split()]
    lines += ["element face %d" % len(mesh[1]),
              "property list %s %s %s" % (count, index, list_name), "end_header"]
    header = line_break.join(lines) + line_break
    vertices = [(*p, *extra(v)) for v, p in enumerate(mesh[0])]
    if form == "ascii":
        rows = [" ".join(map(repr, map(float, p))) for p in vertices]
        rows += ["%d " % len(f) + " ".join(map(str, f)) for f in mesh[1]]
        return (header + line_break.join(rows) + line_break).encode()
    order = {"binary_little_endian": "<", "binary_big_endian": ">"}[form]
    pack = lambda letter, values: struct.pack(order + letter * len(values), *values)
    data = b"".join(pack(letters[coordinate], p) for p in vertices)
    for f in mesh[1]:
        data += pack(letters[count], [len(f)]) + pack(letters[index], f)
    return header.encode() + data


def limit_position(mesh, vertex):
    """Where a vertex inside a closed mesh without hard edges ends on the surface."""
    rings = [(f, f.index(vertex)) for f in mesh[1] if vertex in f]
    n, v, p = len(rings), [0, 0, 0], mesh[0][vertex]
    for face, i in rings:
        at = lambda k: mesh[0][face[(i + k) % len(face)]]
        for k in range(3):
            f = (4 * p[k] + 2 * (at(1)[k] + at(-1)[k]) + (at(2)[k] + at(-2)[k]) / 2) / 9
            v[k] += (9 * f + (n - 4) * p[k]) / (n * (n + 5))
    return v


def edges_of(faces):
    return {frozenset((f[i - 1], f[i])) for f in faces for i in range(len(f))}


def float32(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


# ---- what the tool wrote -------------------------------------------------------------------------

def parse_obj(text):
    """Positions, texture coordinates, normals, triangles; one number serves all three."""
    table = {"v": [], "vt": [], "vn": []}
    triangles = []
    for line in text.splitlines():
        words = line.split()
        if words[0] in table:
            table[words[0]].append(tuple(map(float, words[1:])))
        elif words[0] == "f":
            corners = [set(filter(None, word.split("/"))) for word in words[1:]]
            assert len(corners) == 3 and all(len(c) == 1 for c in corners), line
            triangles.append(tuple(int(c.pop()) - 1 for c in corners))
        else:
            assert words[0] == "#", line
    return table["v"], table["vt"], table["vn"], triangles


def parse_glb(data):
    """The same, and the bytes of an index; insists on what glTF 2.0 asks of such a file."""
    magic, version, length, json_size, json_type = struct.unpack_from("<4sIIII", data)
    assert (magic, version, json_type) == (b"glTF", 2, 0x4E4F534A) and length == len(data)
    assert json_size % 4 == 0
    gltf = json.loads(data[20:20 + json_size].decode("ascii"))
    binary_size, binary_type = struct.unpack_from("<II", data, 20 + json_size)
    binary = data[28 + json_size:]
    assert binary_type == 0x004E4942 and binary_size == len(binary) and binary_size % 4 == 0
    assert gltf["asset"]["version"] == "2.0" and gltf["asset"]["generator"].startswith("patchsurf ")
    assert 0 <= binary_size - gltf["buffers"][0]["byteLength"] < 4

    def read(number):
        accessor = gltf["accessors"][number]
        view = gltf["bufferViews"][accessor["bufferView"]]
        letter, size = {5126: ("f", 4), 5125: ("I", 4), 5123: ("H", 2)}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
        assert view["byteOffset"] % 4 == 0
        assert view["byteLength"] == accessor["count"] * width * size
        assert view["target"] == (34963 if width == 1 else 34962)
        flat = struct.unpack_from("<%d%s" % (accessor["count"] * width, letter), binary,
                                  view["byteOffset"])
        return accessor, size, flat if width == 1 else list(zip(*[iter(flat)] * width))

    (primitive,) = gltf["meshes"][0]["primitives"]
    attributes = primitive["attributes"]
    accessor, _, points = read(attributes["POSITION"])
    for name, choose in (("min", min), ("max", max)):
        assert [float32(x) for x in accessor[name]] == [choose(c) for c in zip(*points)]
    _, index_size, flat = read(primitive["indices"])
    assert max(flat) < len(points) and max(flat) != 256 ** index_size - 1
    uvs = read(attributes["TEXCOORD_0"])[2] if "TEXCOORD_0" in attributes else []
    return (points, uvs, read(attributes["NORMAL"])[2], list(zip(*[iter(flat)] * 3))), index_size


def parse_ply(data):
    """The same of the PLY files that the tool writes."""
    header, binary = data.split(b"end_header\n", 1)
    lines = [line for line in header.decode("ascii").split("\n") if not line.startswith("comment")]
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"] and lines[-1] == ""
    vertices, names = int(lines[2].split()[2]), lines[3:-3]
    assert names[:6] == ["property float " + name for name in "x y z nx ny nz".split()]
    assert names[6:] in ([], ["property float s", "property float t"])
    assert lines[-3].startswith("element face ")
    assert lines[-2] == "property list uchar int vertex_indices"
    faces, width = int(lines[-3].split()[2]), len(names)
    assert len(binary) == 4 * width * vertices + 13 * faces
    rows = [struct.unpack_from("<%df" % width, binary, 4 * width * v) for v in range(vertices)]
    triangles = [struct.unpack_from("<B3i", binary, 4 * width * vertices + 13 * f)
                 for f in range(faces)]
    assert all(t[0] == 3 for t in triangles)
    return ([r[:3] for r in rows], [r[6:] for r in rows if r[6:]], [r[3:6] for r in rows],
            [t[1:] for t in triangles])


def parse_csv(text):
    header, *lines = text.splitlines()
    return header.split(","), [line.split(",") for line in lines]


class ToolTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, text, name="mesh.obj"):
        with open(self.path(name), "wb") as file:
            file.write(text if isinstance(text, bytes) else text.encode())
        return self.path(name)

    def read(self, name, mode="r"):
        with open(self.path(name), mode) as file:
            return file.read()

    def run_tool(self, *arguments, data=None, **options):
        return subprocess.run([TOOL, *map(str, arguments)], input=data, cwd=self.folder,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=300,
                              **options)

    def ok(self, *arguments, status=0, warnings=0, **options):
        """Standard output of a run that must succeed."""
        done = self.run_tool(*arguments, **options)
        error = done.stderr.decode()
        self.assertEqual((done.returncode, error.count("warning"), error.count("\n")),
                         (status, warnings, warnings), (arguments, error))
        return done.stdout.decode()

    def bad(self, *arguments, says, **options):
        """A run that must fail with one line that matches, and leave no file behind."""
        before = sorted(os.listdir(self.folder))
        done = self.run_tool(*arguments, **options)
        error = done.stderr.decode()
        self.assertEqual(done.returncode, 2, (arguments, error))
        self.assertEqual(error.count("\n"), 1, error)
        self.assertTrue(error.isprintable() or error[:-1].isprintable(), error)
        self.assertRegex(error, "^" + says)
        self.assertEqual(sorted(os.listdir(self.folder)), before)

    def info(self, text, *options, **more):
        return json.loads(self.ok("info", self.write(text), "--json", *options, **more))

    def surface(self, text, *options, **more):
        return parse_obj(self.ok("tessellate", self.write(text), "-o", "-", *options, **more))

    def samples(self, text, *options, **more):
        return parse_csv(self.ok("sample", self.write(text), *options, **more))[1]


# ---- commands ------------------------------------------------------------------------------------

class Info(ToolTest):
    def test_counts(self):
        cases = {
            "cube": (CUBE, dict(vertices=8, faces=6, edges=12, max_valence=3, p4=6, components=1)),
            "octahedron": (OCTAHEDRON, dict(vertices=6, faces=8, edges=12, max_valence=4, p3=8)),
            "torus": (torus(8, 5), dict(vertices=40, faces=40, max_valence=4, ordinary=40)),
            "ball": (ball(7, 5), dict(vertices=30, faces=35, max_valence=7, ordinary=21, polar=14)),
            "prism": (prism(5), dict(vertices=10, faces=7, edges=15, p4=5, p5=2)),
            "house": (house(), dict(vertices=10, faces=8, max_valence=4, p3=2, p4=4, p5=2)),
            "cylinder": (prism(8), dict(ngon=2, max_valence=3, ordinary=8)),
            "pillows": (PILLOWS, dict(edges=7, valence2=7, ngon=4, components=2, max_valence=2)),
            "sheet": (grid(4, 3), dict(ordinary=12, boundary_edges=14, max_valence=4)),
            "triangle": (([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]),
                         dict(boundary_edges=3, p3=1, max_valence=2)),
        }
        points = dict(ordinary=16, polar=13, p3=19, p4=25, p5=31)
        for name, (mesh, expected) in cases.items():
            with self.subTest(name):
                info = self.info(obj(mesh))
                expected.setdefault("edges", len(edges_of(mesh[1])))
                for key in ("ordinary", "polar", "p3", "p4", "p5", "ngon", "valence2",
                            "boundary_edges", "hard_edges"):
                    expected.setdefault(key, 0)
                self.assertEqual({key: info[key] for key in expected}, expected)
                pieces = {"cylinder": 16 * 13, "pillows": 14 * 13}.get(name, 0)     # all polar
                self.assertEqual(info["control_points"], pieces
                                 + sum(info[kind] * count for kind, count in points.items()))
                self.assertGreater(info["bytes"], 12 * info["control_points"])
                keys = ("vertices faces edges boundary_edges hard_edges components max_valence "
                        "ordinary polar p3 p4 p5 ngon valence2 control_points bytes").split()
                if name in ("octahedron", "triangle"):
                    keys += "cos_mean cos_std cos_min cos_max convex concave inflection".split()
                self.assertEqual(list(info), keys)
                text = dict(line.split() for line in self.ok("info", "mesh.obj").splitlines())
                self.assertEqual({key: float(value) for key, value in text.items()}, info)

    def test_random_tags(self):
        """Holes, creases and corners at random, against counts from the definitions alone."""
        rng = random.Random(5)
        meshes = (ball(7, 6), torus(6, 5), torus(4, 3), prism(7), house(), grid(6, 5), PILLOWS)
        seen = Counter()
        for vertices, faces in meshes * 8:
            holes, share = rng.choice((0, 0.1)), rng.choice((0, 0.02, 0.2, 0.5))
            kept = [f for f in faces if rng.random() > holes] or faces
            hard = {e for e in edges_of(kept) if rng.random() < share}
            corners = {v for e in hard for v in e if rng.random() < share}
            tags = creases(sorted(map(sorted, hard)))
            tags += "".join("t corner 1/1/0 %d 10\n" % v for v in sorted(corners))
            info = self.info(obj((vertices, kept), tags), "--quiet")
            expected = count_mesh.count(len(vertices), kept, hard, corners)
            self.assertEqual({key: info[key] for key in expected}, expected, tags)
            seen.update(expected)
        self.assertTrue(all(seen[key] > 20 for key in ("hard_edges", "boundary_edges", "ngon")))
        self.assertTrue(all(seen[key] > 20 for key in ("ordinary", "p3", "p4", "polar")), seen)

    def test_components(self):
        a, b = OCTAHEDRON, CUBE
        moved = [(x + 5, y, z) for x, y, z in b[0]]
        both = (a[0] + moved, a[1] + [tuple(v + len(a[0]) for v in f) for f in b[1]])
        self.assertEqual(self.info(obj(both))["components"], 2)

    def test_triangle_facts(self):
        vertices, faces = torus(7, 6)
        triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
        mesh = jitter((vertices, triangles))
        points = [tuple(map(float32, p)) for p in mesh[0]]

        flat = [unit(cross(minus(points[b], points[a]), minus(points[c], points[a])))
                for a, b, c in triangles]
        smooth = [unit([sum(x) for x in zip(*(n for n, t in zip(flat, triangles) if v in t))])
                  for v in range(len(points))]
        cosines = [dot(smooth[v], n) for n, t in zip(flat, triangles) for v in t]
        mean = sum(cosines) / len(cosines)
        bends = Counter()
        for a, b in map(sorted, edges_of(triangles)):
            d = minus(points[b], points[a])
            signs = dot(smooth[a], d) > 0, -dot(smooth[b], d) > 0
            bends["inflection" if signs[0] != signs[1] else
                  "concave" if signs[0] else "convex"] += 1

        info = self.info(obj(mesh))
        for key, value in dict(cos_mean=mean, cos_min=min(cosines), cos_max=max(cosines),
                               cos_std=math.sqrt(sum((c - mean) ** 2 for c in cosines)
                                                 / (len(cosines) - 1))).items():
            self.assertAlmostEqual(info[key], value, places=12)
        self.assertTrue(all(bends.values()) and len(bends) == 3, bends)
        self.assertEqual({key: info[key] for key in bends}, bends)

    def test_convex_and_concave(self):
        self.assertEqual(self.info(obj(OCTAHEDRON))["convex"], 12)
        inside_out = OCTAHEDRON[0], [f[::-1] for f in OCTAHEDRON[1]]
        self.assertEqual(self.info(obj(inside_out))["concave"], 12)


class Tessellate(ToolTest):
    def judge(self, mesh, rate, result):
        points, uvs, normals, triangles = result
        edges = edges_of(mesh[1])
        inside = {m: m * rate * (rate - 1) // 2 + 1 for m in range(5, 20)}
        inside.update({3: (rate - 1) * (rate - 2) // 2, 4: (rate - 1) ** 2})
        count = {m: (m if m != 4 else 2) * rate ** 2 for m in range(4, 20)}
        count[3] = rate ** 2
        self.assertEqual(len(points), len(mesh[0]) + len(edges) * (rate - 1)
                         + sum(inside[len(f)] for f in mesh[1]))
        self.assertEqual(len(triangles), sum(count[len(f)] for f in mesh[1]))
        self.assertEqual((len(normals), uvs), (len(points), []))
        for n in normals:
            self.assertAlmostEqual(sum(x * x for x in n), 1, places=5)
        directed = Counter((t[i - 1], t[i]) for t in triangles for i in range(3))
        self.assertEqual(set(directed.values()), {1})
        self.assertTrue(all((b, a) in directed for a, b in directed))
        self.assertEqual(set(itertools.chain(*triangles)), set(range(len(points))))

    def test_meshes_and_rates(self):
        for mesh in (CUBE, OCTAHEDRON, torus(5, 4), ball(6, 4), house(), prism(7)):
            text = obj(jitter(mesh))
            self.judge(mesh, 8, self.surface(text))
            for rate in (1, 2, 5):
                self.judge(mesh, rate, self.surface(text, "--rate", rate))

    def test_faces_outward(self):
        points, _, normals, triangles = self.surface(obj(ball(8, 6)))
        for p, n in zip(points, normals):
            self.assertGreater(sum(x * y for x, y in zip(p, n)), 0.8)
        volume = sum(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2])
                     + a[2] * (b[0] * c[1] - b[1] * c[0])
                     for a, b, c in ([points[v] for v in t] for t in triangles)) / 6
        self.assertTrue(2.5 < volume < 4 * math.pi / 3, volume)

    def test_limit_positions(self):
        """Vertices of the surface, from the formula for the limit position."""
        mesh = jitter(house())
        surface = set(self.surface(obj(mesh), "--rate", 1)[0])
        for vertex in range(len(mesh[0])):
            v = limit_position(mesh, vertex)
            self.assertTrue(any(math.dist(v, q) < 1e-6 for q in surface), (vertex, v))

    def test_glb_equals_obj(self):
        for mesh in (jitter(CUBE), house()):
            self.write(obj(mesh))
            self.assertEqual(self.ok("tessellate", "mesh.obj", "-o", "out.GLB"), "")
            self.assertEqual(self.ok("tessellate", "mesh.obj", "-o", "out.obj"), "")
            binary, index_size = parse_glb(self.read("out.GLB", "rb"))
            self.assertEqual(index_size, 2)
            for from_binary, from_text in zip(binary, parse_obj(self.read("out.obj"))):
                self.assertEqual(from_binary, [tuple(map(float32, x)) if type(x[0]) is float else x
                                               for x in from_text])

    def test_ply_equals_obj(self):
        square = ((0, 0), (1, 0), (1, 1), (0, 1))
        for text in (obj(jitter(house())), Texture.textured(CUBE, lambda f, i: square[i])):
            self.write(text)
            for name in ("out.ply", "out.obj"):
                self.assertEqual(self.ok("tessellate", "mesh.obj", "-o", name), "")
            from_text = parse_obj(self.read("out.obj"))
            self.assertEqual(parse_ply(self.read("out.ply", "rb")), tuple(
                [tuple(map(float32, x)) if type(x[0]) is float else x for x in part]
                for part in from_text))

    def test_index_width(self):
        self.write(obj(torus(16, 16)))
        for rate, vertices, size in ((15, 57600, 2), (16, 65536, 4)):
            self.ok("tessellate", "mesh.obj", "-o", "out.glb", "--rate", rate)
            (points, *_), index_size = parse_glb(self.read("out.glb", "rb"))
            self.assertEqual((len(points), index_size), (vertices, size))

    def test_no_normal(self):
        """A mesh squashed to a line has no normals, but glTF asks for them."""
        self.write(obj(([(x, 0, 0) for x, _, _ in CUBE[0]], CUBE[1])))
        self.ok("tessellate", "mesh.obj", "-o", "out.glb")
        for n in parse_glb(self.read("out.glb", "rb"))[0][2]:
            self.assertAlmostEqual(sum(x * x for x in n), 1, places=5)


class Texture(ToolTest):
    @staticmethod
    def textured(mesh, uv_of):
        """uv_of(face number, corner number) gives the coordinate, or None."""
        lines = ["v %r %r %r" % tuple(map(float, p)) for p in mesh[0]]
        count = 0
        for f, face in enumerate(mesh[1]):
            line = "f"
            for i, v in enumerate(face):
                uv = uv_of(f, i)
                if uv is None:
                    line += " %d" % (v + 1)
                else:
                    lines.append("vt %r %r" % tuple(map(float, uv)))
                    count += 1
                    line += " %d/%d" % (v + 1, count)
            lines.append(line)
        return "\n".join(lines) + "\n"

    def test_one_chart(self):
        """No seam where corners of a vertex have equal values, whatever their numbers."""
        mesh = house()
        text = self.textured(mesh, lambda f, i: mesh[0][mesh[1][f][i]][:2])
        points, uvs, _, _ = self.surface(text, "--rate", 4)
        self.assertEqual(len(points), len(self.surface(obj(mesh), "--rate", 4)[0]))
        self.assertEqual(len(uvs), len(points))

    def test_chart_per_face(self):
        """Every face its own square: every edge is a seam, and u v are those of the face."""
        square = ((0, 0), (1, 0), (1, 1), (0, 1))
        text = self.textured(jitter(CUBE), lambda f, i: (2 * f + square[i][0], square[i][1]))
        points, uvs, normals, triangles = self.surface(text, "--rate", 4)
        self.assertEqual(len(points), 6 * 25)
        self.assertEqual((len(normals), len(triangles)), (150, 6 * 32))
        found = {(uv, p) for uv, p in zip(uvs, points)}
        for face, _, u, v, *rest in self.samples(text, "--rate", 4):
            uv = 2 * int(face) + float(u), float(v)
            self.assertIn((uv, tuple(map(float, rest[:3]))), found)

    def test_triangle_and_pentagon(self):
        mesh = jitter(house())
        corners = lambda f, i: (f + math.cos(i), math.sin(2 * i))
        text = self.textured(mesh, corners)
        points, uvs, _, _ = self.surface(text, "--rate", 3)
        at = {}
        for uv, p in zip(uvs, points):
            at.setdefault(p, []).append(uv)
        for face, sector, u, v, *rest in self.samples(text, "--rate", 3):
            face, sector, u, v = int(face), int(sector), float(u), float(v)
            size = len(mesh[1][face])
            if size == 3:
                weights = [1 - u - v, u, v]
            elif size == 4:
                weights = [(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v]
            else:
                weights = [(1 - u - v) / size] * size
                weights[sector] += u
                weights[(sector + 1) % size] += v
            uv = [sum(w * corners(face, i)[k] for i, w in enumerate(weights)) for k in (0, 1)]
            self.assertTrue(any(math.dist(uv, other) < 1e-5
                                for other in at[tuple(map(float, rest[:3]))]))

    def test_seam_on_an_open_mesh(self):
        """A sheet in two charts: the line between them is there twice, the rim once."""
        mesh, rate = grid(4, 2), 3
        whole = self.textured(mesh, lambda f, i: mesh[0][mesh[1][f][i]][:2])
        cut = self.textured(mesh, lambda f, i: (mesh[0][mesh[1][f][i]][0] + 10 * (f >= 4),
                                                mesh[0][mesh[1][f][i]][1]))
        points, uvs, normals, triangles = self.surface(whole, "--rate", rate)
        self.assertEqual(len(points), (4 * rate + 1) * (2 * rate + 1))
        cut_points, cut_uvs, _, cut_triangles = self.surface(cut, "--rate", rate)
        self.assertEqual(len(cut_points), len(points) + 2 * rate + 1)
        self.assertEqual(len(cut_triangles), len(triangles))
        place = lambda p, uv: (p, (round(uv[0] - 10 * (uv[0] > 7), 4), round(uv[1], 4)))
        self.assertEqual(set(map(place, cut_points, cut_uvs)), set(map(place, points, uvs)))

    def test_seam_on_a_hard_edge(self):
        """A hard edge is split once, whether a seam runs along it or not."""
        square = ((0, 0), (1, 0), (1, 1), (0, 1))
        options = ("--crease-angle", 45, "--rate", 4)
        plain = self.surface(obj(CUBE), *options)
        text = self.textured(CUBE, lambda f, i: (2 * f + square[i][0], square[i][1]))
        points, uvs, normals, triangles = self.surface(text, *options)
        self.assertEqual((points, normals, triangles), (plain[0], plain[2], plain[3]))
        self.assertEqual(len(set(uvs)), 150)

    def test_missing_coordinates(self):
        text = self.textured(CUBE, lambda f, i: (0.5, 0.25) if f == 0 else None)
        _, uvs, _, _ = self.surface(text, warnings=1)
        self.assertEqual(set(uvs), {(0.5, 0.25), (0, 0)})
        self.assertEqual(set(self.surface(text, "--quiet")[1]), set(uvs))

    def test_one_number_and_glb(self):
        text = self.textured(CUBE, lambda f, i: (0.25, 0)).replace("vt 0.25 0.0", "vt 0.25")
        self.assertEqual(set(self.surface(text)[1]), {(0.25, 0)})
        self.ok("tessellate", "mesh.obj", "-o", "out.glb")
        self.assertEqual(set(parse_glb(self.read("out.glb", "rb"))[0][1]), {(0.25, 1)})


class Sample(ToolTest):
    def test_order_and_domain(self):
        top = [f for f in CUBE[1] if f == (3, 1, 5, 7)]
        for mesh, tags in ((house(), ""), (prism(6), ""), (PILLOWS, ""), (grid(2, 1), ""),
                           (CUBE, creases(edges_of(top)))):     # the top is alone and split
            for rate in (1, 3, 8):
                self.judge(mesh, tags, rate)

    def judge(self, mesh, tags, rate):
        step = lambda i: float32(i / rate)
        expected = []
        for f, face in enumerate(mesh[1]):
            for sector in range(len(face) if len(face) > 4 else 1):
                for v in range(rate + 1):
                    row = rate + 1 if len(face) == 4 else rate + 1 - v
                    expected += [(f, sector, step(u), step(v)) for u in range(row)]
        self.write(obj(mesh, tags))
        header, rows = parse_csv(self.ok("sample", "mesh.obj", "--rate", rate))
        self.assertEqual(header, "face sector u v x y z nx ny nz".split())
        self.assertEqual([(int(r[0]), int(r[1]), float32(float(r[2])), float32(float(r[3])))
                          for r in rows], expected)

    def test_same_bits_as_tessellation(self):
        for mesh in (house(), ball(5, 4), jitter(OCTAHEDRON), prism(6), PILLOWS, grid(2, 2)):
            text = obj(mesh)
            points = self.surface(text, "--rate", 6)[0]
            rows = self.samples(text, "--rate", 6)
            self.assertEqual({tuple(map(float, r[4:7])) for r in rows}, set(points))

    def test_sectors_share_lines(self):
        """Where a sector meets the next one, and at the corners, the text is the same."""
        rate, rows = 4, {}
        for face, sector, u, v, *rest in self.samples(obj(jitter(prism(5))), "--rate", 4):
            rows[int(face), int(sector), float(u), float(v)] = rest
        for face, sector, k in itertools.product((0, 1), range(5), range(rate + 1)):
            self.assertEqual(rows[face, sector, 0, k / rate],
                             rows[face, (sector + 1) % 5, k / rate, 0])

    def test_edges_meet(self):
        """Samples of an edge from both sides, found by the corners' numbers."""
        for mesh, extra in ((house(), ""), (prism(6), ""), (PILLOWS, ""),
                            (CUBE, creases(edges_of(CUBE[1])))):
            self.compare_sides(jitter(mesh), extra)

    def compare_sides(self, mesh, extra):
        rate, sides = 5, {}
        for face, sector, u, v, *rest in self.samples(obj(mesh, extra), "--rate", rate):
            corners = mesh[1][int(face)]
            size, u, v = len(corners), round(float(u) * rate), round(float(v) * rate)
            if size > 4:
                steps = [(int(sector), v)] if u + v == rate else []
            elif size == 4:
                steps = [(0, u)] * (v == 0) + [(1, v)] * (u == rate)
                steps += [(2, rate - u)] * (v == rate) + [(3, rate - v)] * (u == 0)
            else:
                steps = [(0, u)] * (v == 0) + [(1, v)] * (u + v == rate)
                steps += [(2, rate - v)] * (u == 0)
            for i, k in steps:
                a, b = corners[i], corners[(i + 1) % size]
                place = (a, b, k) if a < b else (b, a, rate - k)
                sides.setdefault(place, []).append(rest[:3])
        self.assertEqual(len(sides), len(edges_of(mesh[1])) * (rate + 1))
        for place, points in sides.items():
            self.assertEqual(len(points), 2)
            self.assertEqual(points[0], points[1], place)

    def test_curvature(self):
        columns, text = 24, obj(ball(24, 16))
        header, rows = parse_csv(self.ok("sample", self.write(text), "--curvature", "--rate", 2))
        self.assertEqual(header[10:], ["gauss", "mean"])
        poles = [r for r in rows if abs(float(r[6])) > 0.98 and r[3] == "1" and len(r) == 12
                 and (r[10], r[11]) == ("", "")]
        self.assertEqual(len([r for r in rows if r[10] == ""]), 2 * columns)
        self.assertLessEqual(len(poles), 2 * columns)
        for r in rows:
            if r[10] and abs(float(r[6])) < 0.8:
                self.assertTrue(0.85 < float(r[10]) < 1.25 and -1.15 < float(r[11]) < -0.9, r)
        self.assertEqual([r[:10] for r in rows], self.samples(text, "--rate", 2))

    def test_curvature_scales(self):
        vertices, faces = jitter(torus(7, 5))
        double = [[2 * x for x in p] for p in vertices]
        one = self.samples(obj((vertices, faces)), "--curvature", "--rate", 3)
        two = self.samples(obj((double, faces)), "--curvature", "--rate", 3)
        self.assertTrue(any(float(r[10]) < 0 for r in one) and any(float(r[10]) > 0 for r in one))
        for a, b in zip(one, two):
            self.assertAlmostEqual(float(a[10]), 4 * float(b[10]), delta=1e-3 * abs(float(a[10])))
            self.assertAlmostEqual(float(a[11]), 2 * float(b[11]), delta=1e-3 * abs(float(a[11])))


class Patches(ToolTest):
    def patches(self, text, *options):
        result = json.loads(self.ok("patches", self.write(text), *options))
        self.assertEqual(list(result), ["scheme", "patches"])
        self.assertEqual(result["scheme"], "pm")
        return result["patches"]

    def test_points(self):
        sizes = {"bicubic": 16, "polar": 13, "p3": 19, "p4": 25, "p5": 31}
        seen = set()
        for mesh in (house(), ball(6, 5)):
            text = obj(jitter(mesh))
            corners = {int(r[0]): [] for r in self.samples(text, "--rate", 1)}
            for r in self.samples(text, "--rate", 1):
                corners[int(r[0])].append([float(x) for x in r[4:7]])
            patches = self.patches(text)
            self.assertEqual(sorted(p["face"] for p in patches), list(range(len(mesh[1]))))
            for p in patches:
                self.assertEqual(list(p), ["face", "sector", "kind", "points"])
                points, here = p["points"], corners[p["face"]]
                self.assertEqual((p["sector"], len(points)), (0, sizes[p["kind"]]))
                seen.add(p["kind"])
                if p["kind"] == "bicubic":
                    self.assertEqual([points[k] for k in (0, 3, 12, 15)], here)
                elif p["kind"] == "polar":
                    turned = [points[0], points[3], points[12]]
                    self.assertIn(turned, [here[k:] + here[:k] for k in range(3)])
                else:
                    ring = [points[6 * k] for k in range(int(p["kind"][1]))]
                    rows = {"p3": (0, 1, 2), "p4": (0, 1, 3, 2), "p5": (1, 4, 7, 10, 13)}
                    self.assertEqual(ring, [here[k] for k in rows[p["kind"]]])
        self.assertEqual(seen, set(sizes))

    def test_pieces(self):
        """A split face has a patch for each of its edges, numbered by the edge's first corner."""
        rows = self.samples(obj(prism(6)), "--rate", 1)
        pieces = {}
        for p in self.patches(obj(prism(6))):
            if p["face"] < 2:
                pieces[p["face"], p["sector"]] = p["points"]
                self.assertEqual(p["kind"], "polar")
            else:
                self.assertEqual(p["sector"], 0)
        self.assertEqual(sorted(pieces), list(itertools.product((0, 1), range(6))))
        for face, sector, u, v, *rest in rows[:36]:
            corner = {(1, 0): 0, (0, 1): 3, (0, 0): 12}[int(u), int(v)]
            self.assertEqual([float(x) for x in rest[:3]], pieces[int(face), int(sector)][corner])

    def test_not_finite(self):
        vertices, faces = CUBE
        text = obj(([[3e38 * x for x in p] for p in vertices], faces))
        self.assertIn(None, itertools.chain(*(q for p in self.patches(text) for q in p["points"])))
        result = json.loads(self.ok("check", "mesh.obj", "--json", status=1))
        self.assertGreater(result["nonfinite"], 0)
        self.bad("tessellate", "mesh.obj", "-o", "out.obj", says="mesh.obj: .*not finite")


class Check(ToolTest):
    KEYS = ["samples", "cracks", "max_normal_deg", "sharp_edges", "nonfinite", "degenerate_normals",
            "worst_face", "fallback_edges"]

    def check(self, text, *options):
        """Of a mesh without tags or with them: what check finds."""
        result = json.loads(self.ok("check", self.write(text), "--json", *options))
        self.assertEqual(list(result), self.KEYS)
        return result

    def test_clean(self):
        for mesh in (CUBE, jitter(house()), jitter(ball(9, 6)), jitter(torus(6, 5))):
            for rate in (1, 7, 8):
                result = self.check(obj(mesh), "--rate", rate)
                self.assertEqual(result["samples"], len(edges_of(mesh[1])) * (rate + 1))
                self.assertEqual((result["cracks"], result["sharp_edges"], result["nonfinite"],
                                  result["degenerate_normals"]), (0, 0, 0, 0))
                self.assertLess(result["max_normal_deg"], 0.01)
                self.assertIn(result["worst_face"], range(len(mesh[1])))

    def test_sharp_edges(self):
        self.assertEqual(self.check(obj(CUBE), "--blend", "0")["sharp_edges"], 12)
        self.assertEqual(self.check(obj(CUBE), "--crease-angle", "45")["sharp_edges"], 12)
        self.assertEqual(self.check(obj(CUBE, creases([(0, 1), (1, 3)])))["sharp_edges"], 2)

    def test_open(self):
        """Boundary edges have one side."""
        for mesh in (grid(4, 3), (CUBE[0], CUBE[1][:-1]), (CUBE[0], CUBE[1][:1])):
            result = self.check(obj(jitter(mesh)), "--rate", 5)
            inner = sum(map(len, mesh[1])) - len(edges_of(mesh[1]))
            self.assertEqual((result["samples"], result["cracks"]), (6 * inner, 0))
            self.assertLess(result["max_normal_deg"], 0.01)
            self.assertEqual(result["worst_face"] is None, inner == 0)

    def test_degenerate(self):
        """Edges beside needles are counted apart and listed."""
        vertices, faces = OCTAHEDRON
        vertices = vertices[:4] + [(1, 1e-4, 1e-4)] + vertices[5:]   # nearly on another vertex
        text = obj((vertices, faces))
        result = self.check(text, "--rate", 4)
        sharp = {frozenset((f[i - 1], f[i])) for f in faces if 4 in f and 0 in f for i in range(3)}
        self.assertEqual(result["degenerate_normals"], 5 * len(sharp))
        *facts, listed = self.ok("check", "mesh.obj", "--rate", 4).partition("degenerate edge")
        found = set()
        for line in ("degenerate edge" + listed).splitlines():
            a, b, face = map(int, re.fullmatch(
                r"degenerate edge +vertices (\d) and (\d), face (\d)", line).groups())
            self.assertTrue({a - 1, b - 1} <= set(faces[face]))
            found.add(frozenset((a - 1, b - 1)))
        self.assertEqual(found, sharp)
        line = obj(([(x, 0, 0) for x, y, z in grid(9, 9)[0]], grid(9, 9)[1]))
        lines = self.ok("check", self.write(line)).splitlines()
        self.assertEqual((len(lines), lines[-1]), (8 + 20 + 1, "degenerate edge     ... and more"))

    def test_text(self):
        result = self.check(obj(CUBE))
        text = dict(line.split() for line in self.ok("check", "mesh.obj").splitlines())
        self.assertEqual({key: float(value) for key, value in text.items()}, result)


KINDS = {                               # of triangles: name and points
    "pm": ("p3", 19), "pn": ("pn_tri", 16), "smoothed_n": ("npatch", 19), "hybrid": ("hybrid", 22),
    "png1": ("png1", 25), "wm": ("ribbon", 19), "cubic_wm_b1": ("ribbon", 19),
    "cubic_pn_b1": ("ribbon", 19), "cubic_wm_b2": ("ribbon_b2", 19),
    "cubic_pn_b2": ("ribbon_b2", 19)}


class Schemes(ToolTest):
    """The schemes that take normals, and their options."""

    def patches(self, text, *options):
        return json.loads(self.ok("patches", self.write(text), *options))

    def test_patches(self):
        mesh = jitter(icosahedron())
        for scheme in SCHEMES:
            result = self.patches(obj(mesh), "--scheme", scheme)
            self.assertEqual(result["scheme"], scheme)
            self.assertEqual(sorted(p["face"] for p in result["patches"]), list(range(20)))
            for p in result["patches"]:
                self.assertEqual((p["kind"], len(p["points"]), p["sector"]), (*KINDS[scheme], 0))
        wm, other = (self.patches(obj(mesh), "--scheme", s) for s in ("wm", "cubic_wm_b1"))
        self.assertEqual(wm["patches"], other["patches"])

    def test_passes_through_vertices(self):
        """Corners are the vertices, with the normals of the file to within rounding."""
        rng = random.Random(3)
        for mesh in (jitter(icosahedron()), jitter(house()), grid(3, 2)):
            normals = [unit(combine(1, n, 0.2, [rng.uniform(-1, 1) for _ in range(3)]))
                       for n in mean_normals(mesh)]
            text = obj_normals(mesh, lambda f, i: normals[mesh[1][f][i]])
            for scheme in SCHEMES[1:]:
                rows = self.samples(text, "--scheme", scheme, "--rate", 1)
                seen = {tuple(map(float32, p)): n for p, n in zip(mesh[0], normals)}
                for row in rows:
                    p = tuple(map(float32, map(float, row[4:7])))
                    self.assertIn(p, seen)
                    self.assertLess(math.dist(map(float, row[7:10]), seen[p]), 1e-5, (scheme, row))

    def test_order_and_domain(self):
        """Faces of five and more corners are fans of quads, or of triangles."""
        mesh, step = prism(7), lambda i, rate: float32(i / rate)
        for scheme, pieces in (("pn", (4, 4, 3)), ("wm", (3,) * 5), ("smoothed_n", (3,) * 5)):
            for rate in (1, 3):
                expected = []
                for f, face in enumerate(mesh[1]):
                    for sector, size in enumerate(pieces if f < 2 else (4,)):
                        for v in range(rate + 1):
                            row = rate + 1 if size == 4 else rate + 1 - v
                            expected += [(f, sector, step(u, rate), step(v, rate))
                                         for u in range(row)]
                rows = self.samples(obj(mesh), "--scheme", scheme, "--rate", rate)
                self.assertEqual([(int(r[0]), int(r[1]), float32(float(r[2])),
                                   float32(float(r[3]))) for r in rows], expected)
                lines = {(r[0], int(r[1]), r[2], r[3]): r[4:] for r in rows if int(r[0]) < 2}
                for (face, sector, u, v), rest in lines.items():
                    if u == "0" and sector + 1 < len(pieces):      # where two sectors meet
                        self.assertEqual(lines[face, sector + 1, v, u], rest)

    def test_same_bits_as_tessellation(self):
        for mesh in (jitter(house()), prism(6), grid(2, 2)):
            text = obj(mesh)
            for scheme in SCHEMES[1:]:
                points = self.surface(text, "--rate", 5, "--scheme", scheme)[0]
                rows = self.samples(text, "--rate", 5, "--scheme", scheme)
                self.assertEqual({tuple(map(float, r[4:7])) for r in rows}, set(points), scheme)

    def test_no_cracks(self):
        """On mixed faces, hard edges and normals that differ across edges."""
        rng = random.Random(9)
        for mesh in (house(), ball(7, 5), prism(6), grid(3, 3), OCTAHEDRON, torus(5, 4)):
            mesh = jitter(mesh)
            hard = [e for e in edges_of(mesh[1]) if rng.random() < 0.2]
            flat = [unit(flat_normal(mesh, f)) for f in range(len(mesh[1]))]
            mean = mean_normals(mesh)
            some = lambda f, i: flat[f] if f % 3 == 0 else mean[mesh[1][f][i]]
            for text in (obj(mesh), obj(mesh, creases(map(sorted, hard))),
                         obj_normals(mesh, some)):
                for scheme in SCHEMES[1:]:
                    self.write(text)
                    for rate in (1, 3, 8):
                        result = json.loads(self.ok("check", "mesh.obj", "--json", "--rate", rate,
                                                    "--scheme", scheme))
                        self.assertEqual((result["cracks"], result["nonfinite"]), (0, 0), scheme)
                    csv = self.ok("sample", "mesh.obj", "--rate", 3, "--scheme", scheme)
                    if all(len(f) < 5 for f in mesh[1]):
                        samples = check_cracks.Samples(csv, mesh[1], 3)
                        pairs = check_cracks.shared_sides(mesh[1])
                        self.assertEqual(check_cracks.compare(samples, mesh[1], pairs,
                                                              self.fail)[1], 0)

    def test_smooth(self):
        """G1 where a scheme promises it, and kinks as they were measured where it does not."""
        mesh = halves(flat_torus(5))
        text = obj(mesh)
        angle = lambda *options: json.loads(self.ok("check", self.write(text), "--json", "--rate",
                                                    20, *options))["max_normal_deg"]
        for scheme in ("smoothed_n", "hybrid", "png1", "wm", "cubic_pn_b1"):
            self.assertLess(angle("--scheme", scheme), 0.01)
        for options, kink in ((("cubic_wm_b2",), 1.95), (("cubic_pn_b2",), 2.3), (("pn",), 41),
                              (("smoothed_n", "--variant", "final"), 22),
                              (("smoothed_n", "--variant", "intermediate"), 51)):
            self.assertAlmostEqual(angle("--scheme", *options), kink, delta=0.03 * kink + 0.05)

    def test_flat_cube(self):
        """A cube with the normals of its faces stays the cube, whatever the scheme."""
        flat = [unit(flat_normal(CUBE, f)) for f in range(6)]
        text = obj_normals(CUBE, lambda f, i: flat[f])
        for scheme in SCHEMES[1:]:
            self.assertEqual(self.info(text, "--scheme", scheme)["hard_edges"], 12)
            points, _, normals, _ = self.surface(text, "--scheme", scheme, "--rate", 4)
            self.assertEqual(len(points), 6 * 25)
            for p, n in zip(points, normals):
                axis = max(range(3), key=lambda k: abs(n[k]))
                self.assertLess(math.dist(n, [round(x) for x in n]), 1e-6)
                self.assertAlmostEqual(p[axis], n[axis], places=6)
                self.assertTrue(all(abs(x) <= 1 + 1e-6 for x in p))
        self.assertNotIn("--scheme", text)
        self.assertEqual(self.surface(text), self.surface(obj(CUBE)))       # pm ignores them

    def test_hard_tags(self):
        """On hard edges computed normals have two sides."""
        for scheme in ("pn", "hybrid", "wm"):
            for options, extra in ((("--crease-angle", 45), ""), ((), creases(CUBE_EDGES))):
                self.write(obj(CUBE, extra))
                check = json.loads(self.ok("check", "mesh.obj", "--json", "--scheme", scheme,
                                           *options))
                self.assertEqual((check["sharp_edges"], check["cracks"]), (12, 0))
                points = self.surface(obj(CUBE, extra), "--scheme", scheme, *options)[0]
                self.assertTrue(all(abs(x) <= 1 + 1e-6 for p in points for x in p))

    def test_blends_are_pm_alone(self):
        text = obj(CUBE, creases(CUBE_EDGES, 2))
        plain = self.surface(obj(CUBE), "--scheme", "wm")
        self.assertEqual(self.surface(text, "--scheme", "wm", warnings=1), plain)
        self.assertEqual(self.surface(text, "--scheme", "wm", "--quiet"), plain)

    def test_pn_rules(self):
        """Inner control points of triangles and quads, sigma and the Coons rule."""
        mesh = jitter(halves(torus(4, 3)))
        for sigma in (None, -1, 0, 0.5, 2):
            options = [] if sigma is None else ["--sigma", sigma]
            s = 0.5 if sigma is None else sigma
            for p in self.patches(obj(mesh), "--scheme", "pn", *options)["patches"]:
                b = p["points"]
                e = combine(*(x for k in (1, 2, 4, 6, 7, 8) for x in (1 / 6, b[k])))
                v = combine(*(x for k in (0, 3, 9) for x in (1 / 3, b[k])))
                self.assertLess(math.dist(b[5], combine(1 + s, e, -s, v)), 1e-5)
        # Of corner 0: corners, points beside them on the four edges, and the inner points.
        corners, inner = (0, 3, 15, 12), (5, 6, 10, 9)
        beside = ((1, 4), (7, 2), (14, 11), (8, 13))            # towards the next, the previous
        for options, s in (((), 0.5), (("--sigma", "1"), 1), (("--coons",), None)):
            result = self.patches(obj(jitter(torus(4, 3))), "--scheme", "pn", *options)
            for p in result["patches"]:
                self.assertEqual((p["kind"], len(p["points"])), ("pn_quad", 25))
                g, q = p["points"], [k for pair in beside for k in pair]
                for i in range(4):
                    c = [g[corners[(i + k) % 4]] for k in range(4)]
                    out, back = (g[k] for k in beside[i])
                    far = [g[k] for k in beside[(i + 2) % 4]]
                    side = [g[beside[(i + 1) % 4][0]], g[beside[(i + 3) % 4][1]]]
                    total = combine(*(x for k in q for x in (1, g[k])))
                    if s is None:
                        expected = combine(6 / 9, out, 6 / 9, back, 3 / 9, side[0], 3 / 9, side[1],
                                           -4 / 9, c[0], -2 / 9, c[1], -2 / 9, c[3], -1 / 9, c[2])
                    else:
                        e = combine(2 / 18, out, 2 / 18, back, 2 / 18, total, -1 / 18, far[0],
                                    -1 / 18, far[1])
                        v = combine(4 / 9, c[0], 2 / 9, c[1], 2 / 9, c[3], 1 / 9, c[2])
                        expected = combine(1 + s, e, -s, v)
                    self.assertLess(math.dist(g[inner[i]], expected), 1e-5, options)

    def test_variants(self):
        text = obj(jitter(halves(torus(5, 4)), size=0.2))
        names = {}
        for options in ((), ("--variant", "g1"), ("--variant", "final"),
                        ("--variant", "intermediate"), ("--variant", "final", "--folds"),
                        ("--variant", "final", "--nearly-flat"), ("--sigma", "0.9")):
            names[options] = self.ok("sample", self.write(text), "--scheme", "smoothed_n", *options)
        self.assertEqual(names[()], names["--variant", "g1"])
        different = ["--variant", "g1"], ["--variant", "final"], ["--variant", "intermediate"]
        self.assertEqual(len({names[tuple(o)] for o in different} | {names["--sigma", "0.9"]}), 4)

    def test_folds(self):
        """A fold beyond 90 degrees counts as flat in the listing, and not with --folds: the kink
        of a tetrahedron."""
        mesh = ([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)],
                [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
        for options, kink in (((), 49.9), (("--folds",), 22)):
            result = json.loads(self.ok("check", self.write(obj(mesh)), "--json", "--rate", 20,
                                        "--scheme", "smoothed_n", "--variant", "final", *options))
            self.assertAlmostEqual(result["max_normal_deg"], kink, delta=1)

    def test_plane(self):
        text = obj(jitter(icosahedron()))
        self.write(text)
        plain = self.ok("sample", "mesh.obj", "--scheme", "hybrid")
        self.assertEqual(self.ok("sample", "mesh.obj", "--scheme=hybrid", "--plane=bisector"),
                         plain)
        other = self.ok("sample", "mesh.obj", "--scheme", "hybrid", "--plane", "normals")
        self.assertNotEqual(other, plain)
        check = json.loads(self.ok("check", "mesh.obj", "--scheme", "hybrid", "--plane", "normals",
                                   "--json"))
        self.assertLess(check["max_normal_deg"], 0.01)

    def test_shading_normals(self):
        """tessellate writes what a scheme shades with, sample the normal of the surface."""
        mesh = icosahedron()
        text = obj_normals(mesh, lambda f, i: mesh[0][mesh[1][f][i]])
        rate = 4

        def shaded(scheme, *options):
            points, _, normals, _ = self.surface(text, "--scheme", scheme, "--rate", rate, *options)
            return dict(zip(points, normals))

        def compare(shade, rows, expected, close=1e-5):
            for r in rows:
                p, n = tuple(map(float, r[4:7])), tuple(map(float, r[7:10]))
                corners = [mesh[0][v] for v in mesh[1][int(r[0])]]
                u, v = float(r[2]), float(r[3])
                self.assertLess(math.dist(shade[p], expected(corners, (1 - u - v, u, v), n)), close)

        def linear(n, t, own):
            return unit(combine(t[0], n[0], t[1], n[1], t[2], n[2]))

        def quadratic(n, t, own):                               # the vertices are their normals
            parts = [x for k in range(3) for x in (t[k] ** 2, n[k])]
            for a, b in ((0, 1), (1, 2), (2, 0)):
                d, s = minus(n[b], n[a]), combine(1, n[a], 1, n[b])
                h = unit(combine(1, s, -2 * dot(d, s) / dot(d, d), d))
                parts += [2 * t[a] * t[b], h]
            return unit(combine(*parts))

        of_surface = lambda n, t, own: own
        rows = self.samples(text, "--scheme", "smoothed_n", "--rate", rate)
        compare(shaded("smoothed_n"), rows, linear)
        compare(shaded("smoothed_n", "--shading", "linear"), rows, linear)
        compare(shaded("smoothed_n", "--shading", "quadratic"), rows, quadratic)
        compare(shaded("smoothed_n", "--shading", "exact"), rows, of_surface, 1e-4)
        rows = self.samples(text, "--scheme", "pn", "--rate", rate)
        compare(shaded("pn"), rows, quadratic)
        for scheme in ("hybrid", "png1", "wm"):
            rows = self.samples(text, "--scheme", scheme, "--rate", rate)
            compare(shaded(scheme), rows, of_surface, 1e-4)

    def test_curvature(self):
        """Not at corners, where second derivatives do not exist; inside as it was published."""
        mesh = icosahedron()
        self.write(obj_normals(mesh, lambda f, i: mesh[0][mesh[1][f][i]]))
        for scheme, figures in Report.CURVATURES["sphere", 0].items():
            header, rows = parse_csv(self.ok("sample", "mesh.obj", "--curvature", "--rate", 20,
                                             "--scheme", scheme))
            inside = []
            for r in rows:
                u, v = float(r[2]), float(r[3])
                if max(1 - u - v, u, v) > 0.99:
                    self.assertEqual((r[10], r[11]), ("", ""), (scheme, r))
                elif min(1 - u - v, u, v) > 0.01:
                    inside.append(float(r[10]))
                    self.assertLess(float(r[11]), 0)
            self.assertEqual(len(inside), 20 * 171)
            for value, known in zip((min(inside), max(inside), sum(inside) / len(inside)), figures):
                self.assertAlmostEqual(value, known, delta=1e-3 * known)

    def test_fallback_edges(self):
        """Where hybrid's normals lie in its plane: on a cube. They are counted and named."""
        text = obj(CUBE)
        result = json.loads(self.ok("check", self.write(text), "--json", "--scheme", "hybrid"))
        count = result["fallback_edges"]
        self.assertGreater(count, 0)
        lines = self.ok("check", "mesh.obj", "--scheme", "hybrid").splitlines()
        self.assertEqual(lines[7], "fallback_edges      %d" % count)
        found = set()
        for line in lines[8:]:
            a, b, face = map(int, re.fullmatch(
                r"fallback edge +vertices (\d) and (\d), face (\d)", line).groups())
            self.assertIn(frozenset((a - 1, b - 1)), edges_of([CUBE[1][face]]))
            found.add(frozenset((a, b)))
        self.assertEqual(len(found), count)
        for scheme in SCHEMES[:3]:
            self.assertEqual(json.loads(self.ok("check", "mesh.obj", "--json", "--scheme",
                                                scheme))["fallback_edges"], 0)

    def test_degenerate(self):
        """No value that is not finite, whatever the normals and the edges."""
        vertices, faces = OCTAHEDRON
        opposite = lambda f, i: tuple((1 if i else -1) * x for x in vertices[faces[f][i]])
        along = lambda f, i: unit(minus(vertices[faces[f][i - 1]], vertices[faces[f][i]]))
        squashed = [(x, y, 0) for x, y, z in vertices], faces
        line = [(x, 0, 0) for x, y, z in vertices], faces
        point = [(0, 0, 0)] * 6, faces
        single = OCTAHEDRON[0], OCTAHEDRON[1][:1]
        for text in (obj_normals(OCTAHEDRON, opposite), obj_normals(OCTAHEDRON, along),
                     obj(squashed), obj(line), obj(point), obj(single)):
            for scheme in SCHEMES:
                self.write(text)
                result = json.loads(self.ok("check", "mesh.obj", "--json", "--scheme", scheme))
                self.assertEqual((result["cracks"], result["nonfinite"]), (0, 0), (scheme, text))
                self.ok("tessellate", "mesh.obj", "-o", "out.glb", "--scheme", scheme)

    def test_options_that_do_not_go(self):
        self.write(obj(CUBE))
        run = lambda says, *options: self.bad("sample", "mesh.obj", *options,
                                              says="patchsurf: " + says)
        for option, schemes in ((["--variant", "g1"], ["smoothed_n"]), (["--coons"], ["pn"]),
                                (["--sigma", "1"], ["pn", "smoothed_n"]),
                                (["--plane", "normals"], ["hybrid"]), (["--blend", "1"], ["pm"]),
                                (["--shading", "exact"], ["smoothed_n"])):
            for scheme in SCHEMES:
                if scheme not in schemes:
                    run("%s goes with %s" % (option[0], " and ".join(schemes)), "--scheme", scheme,
                        *option)
                else:
                    self.ok("sample", "mesh.obj", "--scheme", scheme, *option)
        for option in ("--folds", "--nearly-flat"):
            run("%s goes with smoothed_n, not with pm" % option, option)
            run("%s goes with --variant final" % option, option, "--scheme", "smoothed_n")
            run("%s goes with --variant final" % option, option, "--scheme", "smoothed_n",
                "--variant", "g1")
            self.ok("sample", "mesh.obj", option, "--scheme", "smoothed_n", "--variant", "final")
        for option, value, says in (
                ("--variant", "G1", "intermediate, final or g1"), ("--shading", "", "linear"),
                ("--plane", "x", "bisector or normals"), ("--sigma", "nan", "a finite number"),
                ("--sigma", "1e999", "a finite number"), ("--sigma", "1 2", "a finite number"),
                ("--sigma", "", "a finite number")):
            run("%s takes %s" % (option, says), option, value)


class Normals(ToolTest):
    """Normals of the file, and computed ones."""

    def corners(self, text, *options, **more):
        """The normals at the corners, face by face in the corners' order."""
        rows = self.samples(text, "--scheme", "wm", "--rate", 1, *options, **more)
        return [tuple(map(float, r[7:10])) for r in rows]

    def near(self, found, expected, close=1e-5):
        self.assertEqual(len(found), len(expected))
        for a, b in zip(found, expected):
            self.assertLess(math.dist(a, b), close)

    def test_modes(self):
        mesh = jitter(halves(torus(5, 4)), size=0.2)
        mine = [unit(combine(1, n, 0.3, p)) for n, p in zip(mean_normals(mesh), mesh[0])]
        order = [v for f in mesh[1] for v in f]
        plain, text = obj(mesh), obj_normals(mesh, lambda f, i: mine[mesh[1][f][i]])
        at = lambda normals: [normals[v] for v in order]
        self.near(self.corners(text), at(mine))
        self.near(self.corners(text, "--normals", "input"), at(mine))
        for t in (plain, text):
            self.near(self.corners(t, "--normals", "average"), at(mean_normals(mesh)))
            self.near(self.corners(t, "--normals", "average-area"), at(mean_normals(mesh, True)))
        self.near(self.corners(plain), at(mean_normals(mesh)))
        self.near(self.corners(plain, "--normals", "input", warnings=1), at(mean_normals(mesh)))

    def test_length_does_not_matter(self):
        mesh = OCTAHEDRON
        for length in (1e-30, 0.1, 7, 1e30):
            text = obj_normals(mesh, lambda f, i: tuple(length * (1 + i) * x
                                                        for x in mesh[0][mesh[1][f][i]]))
            self.near(self.corners(text), [mesh[0][v] for f in mesh[1] for v in f])
            self.assertEqual(self.info(text, "--scheme", "wm")["hard_edges"], 0)

    def test_limit(self):
        """The vertices of pm's surface, and its normals there, whatever pieces a scheme makes."""
        place = lambda r: (r[0], *map(float, r[4:10]))
        for mesh, tags in ((jitter(icosahedron()), ""), (jitter(house()), ""), (grid(3, 2), ""),
                           (jitter(prism(6)), ""), (CUBE, creases(CUBE_EDGES[:4])),
                           (OCTAHEDRON, creases([(0, 2), (2, 1), (1, 3), (3, 0)]))):
            text = obj(mesh, tags)
            known = {}
            for face, *rest in map(place, self.samples(text, "--rate", 1)):
                known.setdefault(face, []).append(rest)
            for scheme in SCHEMES[1:]:
                rows = self.samples(text, "--rate", 1, "--scheme", scheme, "--normals", "limit")
                for face, *rest in map(place, rows):
                    self.assertTrue(any(math.dist(rest, other) < 1e-4 for other in known[face]),
                                    (scheme, face, rest, known[face]))
                check = json.loads(self.ok("check", "mesh.obj", "--scheme", scheme, "--json",
                                           "--normals", "limit"))
                self.assertEqual((check["cracks"], check["nonfinite"]), (0, 0))
        mesh = jitter(house())
        points = self.surface(obj(mesh), "--rate", 1, "--scheme", "wm", "--normals", "limit")[0]
        for v in range(len(mesh[0])):
            self.assertTrue(any(math.dist(limit_position(mesh, v), q) < 1e-6 for q in points))

    def test_missing(self):
        """One corner without a normal, or with one of length zero: they are averaged."""
        mesh = icosahedron()
        own = lambda f, i: mesh[0][mesh[1][f][i]]
        average = self.corners(obj(mesh), "--normals", "average")
        for missing in (None, (0, 0, 0)):
            text = obj_normals(mesh, lambda f, i: missing if (f, i) == (4, 1) else own(f, i))
            self.assertEqual(self.corners(text, warnings=1), average)
            self.assertEqual(self.corners(text, "--quiet"), average)
            self.assertEqual(self.corners(text, "--normals", "average"), average)
            self.surface(text)                                  # pm does not miss it
        done = self.run_tool("check", self.write(text), "--scheme", "wm")
        self.assertIn(b"1 of 60 face corners have no normal, so all normals are averaged",
                      done.stderr)

    def test_malformed(self):
        """Said where it stands, if normals are asked for."""
        for bad in ("vn 0 x 1", "vn 0 1", "vn", "vn nan nan nan", "vn 1 inf 0", "vn 0 0 1e39",
                    "vn 0 0 0x1"):
            text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n%s\nf 1//%d 2//1 3//1\n"
            for command in (["sample"], ["check"], ["info"], ["tessellate", "-o", "out.obj"]):
                self.write(text % (bad, 2))
                self.bad(command[0], "mesh.obj", *command[1:], "--scheme", "pn",
                         says="mesh.obj:5: normal is not three finite numbers")
                self.bad(command[0], "mesh.obj", *command[1:], "--scheme", "pn", "--normals=input",
                         says="mesh.obj:5: normal is not three finite numbers")
                self.ok(command[0], "mesh.obj", *command[1:])
                self.ok(command[0], "mesh.obj", *command[1:], "--scheme", "pn", "--normals=average")
                self.write(text % (bad, 1))                     # a bad one that nobody names
                self.ok(command[0], "mesh.obj", *command[1:], "--scheme", "pn")
        self.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//2\n")
        self.bad("check", "mesh.obj", "--scheme", "wm",
                 says="mesh.obj:5: face refers to normal 2, the file has 1")

    def test_welding(self):
        """Normals of a vertex that differ by less than a degree across an edge are one."""
        mesh, rng = icosahedron(), random.Random(2)
        for degrees, hard in ((0.0, 0), (0.1, 0), (0.45, 0), (3, 30)):
            def turned(f, i):
                p = mesh[0][mesh[1][f][i]]
                by = unit(cross(p, [rng.uniform(-1, 1) for _ in range(3)]))
                return combine(math.cos(math.radians(degrees)), p,
                               math.sin(math.radians(degrees)), by)
            text = obj_normals(mesh, turned)
            info = self.info(text, "--scheme", "wm")
            if not hard:
                self.assertEqual(info["hard_edges"], 0, degrees)
                self.assertEqual(len(self.surface(text, "--rate", 2, "--scheme", "wm")[0]), 42)
            else:
                self.assertGreater(info["hard_edges"], 25)
            self.assertEqual(self.info(text)["hard_edges"], 0)

    def test_welding_of_a_chain(self):
        """A fan whose normal turns a little from face to face: too far apart to be one, and equal
        ones are one nevertheless."""
        count = 12
        rim = [(math.cos(2 * math.pi * k / count), math.sin(2 * math.pi * k / count), 0)
               for k in range(count)]
        mesh = ([(0, 0, 0.2)] + rim, [(0, 1 + k, 1 + (k + 1) % count) for k in range(count)])
        turn = lambda k: (math.sin(math.radians(0.8 * (k // 2))), 0,
                          math.cos(math.radians(0.8 * (k // 2))))
        text = obj_normals(mesh, lambda f, i: turn(f) if i == 0 else (0, 0, 1))
        self.assertEqual(self.info(text, "--scheme", "wm")["hard_edges"], 6)

    def test_ply(self):
        """Normals per vertex, in every format; other names and types are no normals."""
        mesh = [tuple(map(float32, p)) for p in jitter(icosahedron())[0]], icosahedron()[1]
        normals = [tuple(map(float32, unit(p))) for p in mesh[0]]
        expected = self.corners(obj_normals(mesh, lambda f, i: normals[mesh[1][f][i]]))
        average = self.corners(obj(mesh))
        for form in ("ascii", "binary_little_endian", "binary_big_endian"):
            for names, result in (("x y z nx ny nz", expected), ("x y z nx ny n", average)):
                data = ply(mesh, form, vertex_names=names, extra=lambda v: normals[v])
                self.write(data, "in.ply")
                rows = parse_csv(self.ok("sample", "in.ply", "--scheme", "wm", "--rate", 1))[1]
                self.near([tuple(map(float, r[7:10])) for r in rows], result)
        bad = lambda v: (0, 0, math.nan if v == 3 else 1)
        for form, says in (("ascii", "in.ply:18: normal is not three finite numbers"),
                           ("binary_big_endian", "in.ply: vertex 3, counting from 0: normal is")):
            self.write(ply(mesh, form, vertex_names="x y z nx ny nz", extra=bad), "in.ply")
            self.bad("check", "in.ply", "--scheme", "hybrid", says=says)
            self.ok("check", "in.ply")

    def test_round_trip(self):
        """What tessellate writes is read with its normals."""
        self.write(obj(icosahedron()))
        expected = {}
        for name in ("out.ply", "out.obj"):
            self.ok("tessellate", "mesh.obj", "-o", name, "--rate", 2, "--scheme", "wm")
            expected[name] = self.ok("sample", name, "--scheme", "pn", "--rate", 2)
            self.assertNotEqual(self.ok("sample", name, "--scheme", "pn", "--rate", 2, "--normals",
                                        "average"), expected[name])
        for a, b in zip(*(text.splitlines()[1:] for text in expected.values())):
            self.near([list(map(float, a.split(",")))], [list(map(float, b.split(",")))], 1e-6)

    def test_info(self):
        """Cosines and bends by the normals that are asked for."""
        quads = flat_torus(5)
        mesh = halves(quads)
        of_quads = mean_normals(quads)
        text = obj_normals(mesh, lambda f, i: of_quads[mesh[1][f][i]])
        published = (0.726595, 0.0808356, 0.620812, 0.826384)       # Table 5
        keys = ("cos_mean", "cos_std", "cos_min", "cos_max")
        for options in (("--normals", "input"), ("--scheme", "wm")):
            info = self.info(text, *options)
            for key, value in zip(keys, published):
                self.assertAlmostEqual(info[key], value, delta=1e-6)
        plain = self.info(obj(mesh))
        for options in ((), ("--normals", "average"), ("--scheme", "pn", "--normals", "average")):
            info = self.info(text, *options)
            self.assertEqual([info[k] for k in keys], [plain[k] for k in keys])
        for options, normals in (((), mean_normals(mesh)), (("--normals=input",), of_quads),
                                 (("--normals=average-area",), mean_normals(mesh, True))):
            info, bends = self.info(text, *options), Counter()
            for a, b in map(sorted, edges_of(mesh[1])):
                d = minus(mesh[0][b], mesh[0][a])
                signs = dot(normals[a], d) > 0, -dot(normals[b], d) > 0
                bends["inflection" if signs[0] != signs[1] else
                      "concave" if signs[0] else "convex"] += 1
            self.assertEqual({key: info[key] for key in bends}, bends)
            cosines = [dot(normals[v], unit(flat_normal(mesh, f)))
                       for f, face in enumerate(mesh[1]) for v in face]
            self.assertAlmostEqual(info["cos_mean"], sum(cosines) / len(cosines), places=6)
        octahedron = self.info(obj(OCTAHEDRON), "--normals", "limit")
        self.assertEqual((octahedron["convex"], octahedron["concave"]), (12, 0))
        self.assertAlmostEqual(octahedron["cos_mean"], 1 / math.sqrt(3), places=6)
        self.assertAlmostEqual(octahedron["cos_std"], 0, places=6)

    def test_info_on_hard_edges(self):
        """Beside hard edges every side has a mean of its own."""
        mesh = CUBE[0], [t for a, b, c, d in CUBE[1] for t in ((a, b, c), (a, c, d))]
        info = self.info(obj(mesh, creases(CUBE_EDGES)))
        self.assertEqual((info["cos_min"], info["cos_max"], info["hard_edges"]), (1, 1, 12))
        self.assertLess(self.info(obj(mesh))["cos_max"], 0.9)


class Report(ToolTest):
    DISTANCES = {                       # scheme: min, max, mean, printed deviation
        ("sphere", 0): {
            "hybrid": (-0.00274014, 0.0131108, 0.00498299, 0.00479724),
            "png1": (-0.0111526, 0, -0.00695174, 0.00452694),
            "wm": (-0.0105214, 0, -0.00507952, 0.00375258),
            "cubic_wm_b1": (-0.0105212, 0, -0.0050795, 0.00375258)},
        ("sphere", 1): {
            "hybrid": (-0.000161588, 0.00126064, 0.000440331, 0.000403261),
            "png1": (-0.00230867, 0, -0.000629614, 0.000615845),
            "wm": (-0.000817776, 0, -0.000329054, 0.000245696),
            "cubic_wm_b1": (-0.000817716, 0, -0.000329053, 0.000245695)},
        ("torus", 5): {
            "hybrid": (-0.0227294, 0.0478425, 0.00720392, 0.015833),
            "png1": (-0.158901, 0.044207, -0.00913514, 0.0326367),
            "wm": (-0.0977793, 0.0493978, -0.00872526, 0.0304518),
            "cubic_wm_b1": (-0.0977793, 0.0493978, -0.00872526, 0.0304518)},
        ("torus", 10): {
            "hybrid": (-0.00262406, 0.00356019, 0.000410239, 0.000964081),
            "png1": (-0.00952291, 0.00411868, -0.000726871, 0.00221538),
            "wm": (-0.00544271, 0.00396627, -0.000399186, 0.00178612),
            "cubic_wm_b1": (-0.00544268, 0.00396627, -0.000399186, 0.00178612)},
        ("torus", 20): {
            "hybrid": (-0.000292093, 0.000354946, 2.6755e-05, 0.000100177),
            "png1": (-0.000647008, 0.000430048, -4.78646e-05, 0.00017302),
            "wm": (-0.000424266, 0.000427842, -1.60885e-05, 0.000150207),
            "cubic_wm_b1": (-0.000424266, 0.000427842, -1.60887e-05, 0.000150205)}}
    CURVATURES = {
        ("sphere", 0): {
            "hybrid": (0.327537, 1.83937, 0.901277, 0.414196),
            "png1": (0.807412, 1.45757, 1.04739, 0.131043),
            "cubic_wm_b1": (0.768408, 1.1719, 0.971776, 0.123817)},
        ("torus", 5): {
            "hybrid": (-820.956, 63.2143, -2.50575, 29.3715),
            "png1": (-8.33147, 8.23699, -0.585947, 2.33862),
            "cubic_wm_b1": (-9.8852, 10.9848, -0.61218, 2.58269)}}
    KEYS = ["mesh", "step", "scheme", "min", "max", "mean", "std", "std_printed"]

    def report(self, *arguments, **more):
        return json.loads(self.ok("report", *arguments, "--json", **more))

    def test_distances(self):
        """Every row within what single precision cost the papers."""
        for table in ("sphere", "torus"):
            result = self.report(table)
            rows = {(r["mesh"], r["step"], r["scheme"]): r for r in result["rows"]}
            expected = {(*key, scheme): figures for key, schemes in self.DISTANCES.items()
                        for scheme, figures in schemes.items() if key[0] == table}
            self.assertEqual(list(rows), list(expected))
            for key, figures in expected.items():
                row = rows[key]
                self.assertEqual([k for k in row if k != "printed"], self.KEYS)
                self.assertEqual(tuple(row["printed"].values()), figures)
                for name, value in zip(("min", "max", "mean", "std_printed"), figures):
                    self.assertAlmostEqual(row[name], value, delta=1e-6, msg=(key, name))
                self.assertAlmostEqual(row["std_printed"] ** 2,
                                       row["std"] ** 2 + row["mean"] ** 2 / 4, places=15)
            for key, row in rows.items():           # two names of one surface
                if key[2] == "wm":
                    self.assertEqual(row["mean"], rows[(*key[:2], "cubic_wm_b1")]["mean"])

    def test_cosines(self):
        row = self.report("torus")["cosines"][0]
        self.assertEqual((row["mesh"], row["step"]), ("torus", 5))
        for key, value in dict(mean=0.726595, std=0.0808356, min=0.620812, max=0.826384).items():
            self.assertAlmostEqual(row[key], value, delta=1e-6)

    def test_curvature(self):
        rows = self.report("curvature")["rows"]
        self.assertEqual(len(rows), 6)
        for row in rows:
            figures = self.CURVATURES[row["mesh"], row["step"]][row["scheme"]]
            for name, value in zip(("min", "max", "mean", "std"), figures):
                self.assertAlmostEqual(row[name], value, delta=1e-4 * abs(value))
            self.assertEqual(row["std"], row["std_printed"])

    def test_steps(self):
        """At any step, those without printed figures too; distances fall at every one."""
        means = []
        for step in range(4):
            rows = self.report("sphere", "--step", step)["rows"]
            self.assertEqual([(r["step"], r["scheme"]) for r in rows],
                             [(step, s) for s in ("hybrid", "png1", "wm", "cubic_wm_b1")])
            self.assertEqual(["printed" in r for r in rows], [step < 2] * 4)
            means.append([abs(r["mean"]) for r in rows])
        for before, after in zip(means, means[1:]):
            self.assertTrue(all(8 * b < a for a, b in zip(before, after)), (before, after))
        for step in (3, 7):
            rows = self.report("torus", "--step", step)["rows"]
            self.assertEqual({r["step"] for r in rows}, {step})
        for step, meshes in ((1, ["sphere"]), (3, ["sphere", "torus"]), (9, ["torus"])):
            rows = self.report("curvature", "--step", step, "--scheme", "wm")["rows"]
            self.assertEqual([(r["mesh"], r["step"]) for r in rows], [(m, step) for m in meshes])

    def test_other_schemes(self):
        for scheme in SCHEMES:
            rows = self.report("sphere", "--step", 1, "--scheme", scheme)["rows"]
            self.assertEqual([r["scheme"] for r in rows], [scheme])
        plain, final = (self.report("sphere", "--step", 1, "--scheme", "smoothed_n", *o)["rows"][0]
                        for o in ((), ("--variant", "final")))
        self.assertNotEqual(plain["mean"], final["mean"])
        given, average = (self.report("sphere", "--step", 1, *o)["rows"][0]["mean"]
                          for o in ((), ("--normals", "average-area")))
        self.assertNotEqual(given, average)

    def test_against_samples(self):
        """The same statistics of what sample writes, in single precision: an independent count."""
        mesh = icosahedron()
        text = obj_normals(mesh, lambda f, i: mesh[0][mesh[1][f][i]])
        for row in self.report("sphere", "--step", 0)["rows"]:
            points = [tuple(map(float, r[4:7])) for r in
                      self.samples(text, "--rate", 20, "--scheme", row["scheme"])]
            self.assertEqual(len(points), 20 * 231)
            d = [math.sqrt(dot(p, p)) - 1 for p in points]
            mean = sum(d) / len(d)
            std = math.sqrt(sum((x - mean) ** 2 for x in d) / (len(d) - 1))
            for name, value in dict(min=min(d), max=max(d), mean=mean, std=std).items():
                self.assertAlmostEqual(row[name], value, delta=5e-7)

    def test_mesh(self):
        """The statistics of a mesh on the command line, found and computed normals, hard edges."""
        mesh = halves(flat_torus(5))
        known = {r["scheme"]: r for r in self.report("curvature")["rows"] if r["mesh"] == "torus"}
        rows = self.report("curvature", self.write(obj(mesh)))["rows"]
        self.assertEqual([r["mesh"] for r in rows[6:]], [self.path("mesh.obj")] * 3)
        for row in rows[6:]:
            for key in ("min", "max", "mean", "std"):
                value = known[row["scheme"]][key]
                self.assertAlmostEqual(row[key], value, delta=2e-3 * abs(value))
        sphere = icosahedron()
        text = obj_normals(sphere, lambda f, i: sphere[0][sphere[1][f][i]])
        row = self.report("curvature", self.write(text), "--scheme", "wm")["rows"][-1]
        self.assertAlmostEqual(row["mean"], 0.971776, delta=1e-4)
        self.report("curvature", self.write(obj(house(), creases(edges_of(house()[1][:1])))))
        self.bad("report", "curvature", self.write("v 0 0 0\nv 1 0 0\nf 1 2 3\n"),
                 says=".*mesh.obj:3: face refers to vertex 3")
        self.bad("report", "curvature", self.write(BadInput.TRIANGLE + "f 1 2 1\n"),
                 says=".*mesh.obj:4: .*twice")

    def test_costs(self):
        result = self.report("costs")
        printed = {"hybrid": ((36, 60, 6), (4, 9, 1), (40, 69, 7)),
                   "png1": ((36, 36, 6), (19, 27, 4), (55, 63, 10)),
                   "wm": (None, (6, 6, 3), (6, 6, 3)), "cubic_wm_b1": (None, (8, 9, 3), (8, 9, 3))}
        rows = {(r["scheme"], r["part"]): r for r in result["rows"]}
        for scheme, figures in printed.items():
            for part, known in zip(("boundary", "interior", "total"), figures):
                if known:
                    row = rows.pop((scheme, part))
                    self.assertEqual(tuple(row["printed"].values()), known)
                    self.assertEqual(tuple(row["computed"].values()), known)
        self.assertEqual(rows, {})
        self.assertEqual(list(result["differences"]), list(printed))
        for difference in result["differences"].values():       # to the library's points
            self.assertLess(difference, 1e-14)

    def test_patches(self):
        result = self.report("patches")
        self.assertEqual([(r["kind"], r["computed"]) for r in result["control_points"]],
                         [("ordinary", 16), ("polar", 13), ("p3", 19), ("p4", 25), ("p5", 31)])
        self.assertEqual([r["step"] for r in result["rows"]], [5, 9, 17, 33, 65])
        for row in result["rows"]:
            n = row["step"]
            self.assertEqual((row["mesh"], row["vertices"], row["faces"], row["p5"]),
                             ("dodecahedra", 200, 120, 120))
            self.assertEqual(row["evaluations"], 120 * 5 * n * (n + 1) // 2)
            self.assertEqual({k: row[k] for k in row["printed"]}, row["printed"])
        rows = self.report("patches", self.write(obj(house())), "--step", 4)["rows"]
        self.assertEqual([r["step"] for r in rows], [4, 4])
        row = rows[1]
        self.assertEqual((row["p3"], row["p4"], row["p5"], row["ngon"]), (2, 4, 2, 0))
        self.assertEqual(row["evaluations"], 4 * 16 + 2 * 10 + 2 * 50)

    def test_text(self):
        """What people read has the figures of the JSON, and the printed ones below."""
        for table in ("sphere", "torus", "curvature"):
            text = self.ok("report", table)
            for row in self.report(table)["rows"]:
                line = "%-12s %5d  %-14s" % (row["mesh"], row["step"], row["scheme"])
                (found,) = [k for k, l in enumerate(text.splitlines()) if l.startswith(line)]
                lines = text.splitlines()[found:found + 3]
                self.assertEqual(lines[0].split()[3:6],
                                 ["%.6g" % row[k] for k in ("min", "max", "mean")])
                self.assertEqual(lines[1].split()[1:],
                                 ["%.6g" % x for x in row["printed"].values()])
                self.assertEqual(lines[2].split()[0], "difference")
        for table in ("costs", "patches"):
            self.assertIn("difference", self.ok("report", table))

    def test_plot(self):
        for table, options, steps in (("sphere", ["--step", 2], 3), ("torus", ["--step", 12], 3),
                                      ("sphere", ["--step", 1, "--scheme", "pn"], 2)):
            self.ok("report", table, *options, "--svg", "plot.svg")
            svg = xml.etree.ElementTree.parse(self.path("plot.svg")).getroot()
            self.assertEqual(svg.tag, "{http://www.w3.org/2000/svg}svg")
            words = [e.text for e in svg.iter("{http://www.w3.org/2000/svg}text")]
            for scheme in ("hybrid", "png1", "wm", "cubic_wm_b1"):
                self.assertEqual(scheme in words, "--scheme" not in options)
            self.assertIn("mean absolute distance", words)
            lines = [e.get("d") for e in svg.iter("{http://www.w3.org/2000/svg}path")]
            curves = [d for d in lines if "h40M" in d]
            self.assertEqual(len(curves), 1 if "--scheme" in options else 4)
            for d in curves:            # falling, that is to larger y
                points = re.findall(r"([\d.]+) ([\d.]+)", d.split("h40M")[1])
                self.assertEqual(len(points), steps)
                self.assertEqual(points, sorted(points, key=lambda p: float(p[0])))
                ys = [float(y) for _, y in points]
                self.assertTrue(all(50 <= a < b <= 420 for a, b in zip(ys, ys[1:])))
        self.bad("report", "sphere", "--svg", "none/plot.svg", says="none/plot.svg: cannot write")

    def test_bad_usage(self):
        self.write(obj(CUBE))
        for arguments, says in (
                ([], "report needs a table"), (["table"], "there is no report table"),
                (["sphere", "mesh.obj"], "report sphere takes no mesh"),
                (["costs", "mesh.obj"], "report costs takes no mesh"),
                (["patches", "mesh.obj", "mesh.obj"], "one mesh at a time"),
                (["sphere", "--step", "9"], "report sphere has steps from 0 to 8, not 9"),
                (["torus", "--step", "2"], "report torus has steps from 3 to 1000, not 2"),
                (["sphere", "--step", "x"], "--step takes a whole number"),
                (["sphere", "--step", "-1"], "--step takes a whole number"),
                (["sphere", "--step", "1.5"], "--step takes a whole number"),
                (["patches", "--step", "1"], "report patches has steps from 2"),
                (["costs", "--step", "1"], "report costs has no steps"),
                (["costs", "--svg", "x.svg"], "report costs has no plot"),
                (["sphere", "--svg", "-"], "--svg needs a file name"),
                (["patches", "--scheme", "wm"], "report patches takes no --scheme"),
                (["sphere", "--scheme", "x"], "unknown scheme x"),
                (["sphere", "--rate", "3"], "report has no option --rate"),
                (["sphere", "--scheme", "wm", "--coons"], "--coons goes with pn")):
            self.bad("report", *arguments, says="patchsurf: " + says)
        self.bad("report", "patches", "none.obj", says="none.obj: cannot open the file: ")


class Blend(ToolTest):
    """Creases of OpenSubdiv's tags, and --blend."""

    def test_crease_is_a_blend_ratio(self):
        for s in ("0.5", "1", "2.75", "9.99"):
            ratio = repr(2 / 3 * 2 ** -float(s))
            self.assertEqual(self.surface(obj(CUBE, creases(CUBE_EDGES, s))),
                             self.surface(obj(CUBE), "--blend", ratio))

    def test_default(self):
        plain = self.surface(obj(CUBE))
        self.assertEqual(self.surface(obj(CUBE), "--blend", repr(2 / 3)), plain)
        for s in ("0", "-3"):
            text = obj(CUBE, creases(CUBE_EDGES, s))
            self.assertEqual(self.surface(text, "--blend", "0.1"), plain)
        self.assertNotEqual(self.surface(obj(CUBE), "--blend", "0.1"), plain)

    def test_one_edge(self):
        one = self.surface(obj(CUBE, creases([(0, 1)], 3)))
        self.assertNotEqual(one, self.surface(obj(CUBE)))
        for other in ("t crease 2/1/0 1 0 3\n",                    # either direction
                      "t crease 2/1/0 0 1 1\nt crease 2/1/0 1 0 3\n",   # the last one counts
                      "t crease 4/2/0 0 1 2 3 3 0\n",              # one sharpness for each edge
                      "t crease 4/1/0 0 1 1 0 3 # as above\n"):
            self.assertEqual(self.surface(obj(CUBE, other)), one, other)

    def test_tags_without_effect(self):
        plain = self.surface(obj(CUBE))
        for extra in ("t corner 1/1/0 0 10.0\n", "t corner 1/1/0 7 2.5\nt corner 2/2/0 1 2 3 4\n",
                      "t hole 1/0/0 1\n", "t creasemethod 0/0/1 chaikin\n"):
            self.assertEqual(self.surface(obj(CUBE, extra), warnings=1), plain)
            self.assertEqual(self.surface(obj(CUBE, extra), "--quiet"), plain)


class Sharp(ToolTest):
    """Hard edges, boundaries and corners."""

    def near(self, p, points):
        return any(math.dist(p, q) < 1e-6 for q in points)

    def test_crease_angle(self):
        """A cube whose edges are all hard stays a cube."""
        for angle, hard in (("89.9", 12), ("90", 0), ("180", 0), ("0", 12)):
            self.assertEqual(self.info(obj(CUBE), "--crease-angle", angle)["hard_edges"], hard)
        info = self.info(obj(CUBE), "--crease-angle=45")
        self.assertEqual((info["ordinary"], info["ngon"]), (6, 0))
        rate = 4
        points, _, normals, triangles = self.surface(obj(CUBE), "--crease-angle", 45, "--rate", 4)
        self.assertEqual(len(points), 6 * (rate + 1) ** 2)
        for p, n in zip(points, normals):
            axis = max(range(3), key=lambda k: abs(n[k]))
            self.assertEqual((abs(n[axis]), p[axis]), (1, n[axis]))
            self.assertTrue(all(abs(x) <= 1 for x in p))
        tagged = self.surface(obj(CUBE, creases(CUBE_EDGES)), "--rate", 4)
        self.assertEqual(tagged[0], points)
        self.assertEqual(self.surface(obj(CUBE, creases(CUBE_EDGES, 2)), "--crease-angle", 45,
                                      "--rate", 4)[0], points)

    def test_fold_of_any_faces(self):
        """Folds between the mean planes of faces of any size, closed and open."""
        flat = ([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0)],
                [(0, 1, 2, 3), (2, 1, 4)])
        self.assertEqual(self.info(obj(flat), "--crease-angle", 0)["hard_edges"], 0)
        turned = math.radians(30)
        flat[0][4] = (1 + math.cos(turned), 0.5, math.sin(turned))
        for angle, hard in ((29.9, 1), (30.1, 0)):
            self.assertEqual(self.info(obj(flat), "--crease-angle", angle)["hard_edges"], hard)
        info = self.info(obj(prism(12)), "--crease-angle", 45)
        self.assertEqual((info["hard_edges"], info["ngon"], info["ordinary"]), (24, 2, 12))

    def test_sharpness_from_10(self):
        loop = edges_of([CUBE[1][3]])
        for s, hard in (("9.99", 0), ("10", 4), ("11", 4), ("1e9", 4)):
            self.assertEqual(self.info(obj(CUBE, creases(loop, s)))["hard_edges"], hard)
        twice = creases(loop) + creases(loop, 1)
        self.assertEqual(self.surface(obj(CUBE, twice)), self.surface(obj(CUBE, creases(loop, 1))))

    def test_crease_curve(self):
        """Vertices of a crease and of a boundary: (a + 4 x + b) / 6, on both its sides."""
        mesh = jitter(CUBE)
        face = mesh[1][3]
        top = obj(mesh, creases(edges_of([face])))
        rim = obj((mesh[0], [f for f in mesh[1] if f != face]))
        for text, copies in ((top, 2), (rim, 1)):
            points = self.surface(text, "--rate", 1)[0]
            for i, v in enumerate(face):
                a, x, b = (mesh[0][k] for k in (face[i - 1], v, face[(i + 1) % 4]))
                p = [(s + 4 * t + u) / 6 for s, t, u in zip(a, x, b)]
                self.assertEqual(sum(math.dist(p, q) < 1e-6 for q in points), copies)

    def test_corner(self):
        """A corner keeps its vertex in place, where two sharp edges meet."""
        sheet = jitter(grid(3, 3))
        plain = self.surface(obj(sheet), "--rate", 1)[0]
        for v in range(16):
            with self.subTest(v):
                one_face, inside = v in (0, 3, 12, 15), v in (5, 6, 9, 10)
                self.assertEqual(self.near(sheet[0][v], plain), one_face)
                tag = "t corner 1/1/0 %d 10\n" % v
                points = self.surface(obj(sheet, tag), "--rate", 1, warnings=inside)[0]
                self.assertEqual(self.near(sheet[0][v], points), not inside)
                self.assertEqual(points == plain, one_face or inside)
        line = creases([(4, 5), (5, 6), (6, 7)])
        points = self.surface(obj(sheet, line + "t corner 2/2/0 5 6 10 9\n"), warnings=1)[0]
        self.assertTrue(self.near(sheet[0][5], points))
        self.assertFalse(self.near(sheet[0][6], points))
        self.ok("info", self.write(obj(sheet, creases([(5, 6)]) + "t corner 1/1/0 5 10\n")),
                warnings=1)

    def test_boundary_interpolation(self):
        sheet = jitter(grid(3, 2))
        plain = self.surface(obj(sheet))
        for value in (0, 1, 2):
            text = obj(sheet, "t interpolateboundary 1/0/0 %d\n" % value)
            self.assertEqual(self.surface(text), plain)


class Far(ToolTest):
    """Meshes far from the origin, where floats lose digits."""

    BY = (1000, 0, -4000)

    def pairs(self):
        """Texts of meshes about the origin, and of the same meshes moved without rounding."""
        for mesh in (jitter(house()), jitter(ball(9, 6)), jitter(prism(6)), jitter(grid(3, 2))):
            mesh = about_origin(mesh)
            uv = lambda f, i: (f % 2, i)
            yield (Texture.textured(mesh, uv), Texture.textured(moved(mesh, self.BY), uv))

    def put(self, points, k=0):
        """Moved as the tool moves them, which rounds once; k: where in a row a point begins."""
        return [(*p[:k], *(float32(x + t) for x, t in zip(p[k:k + 3], self.BY)), *p[k + 3:])
                for p in points]

    def floats(self, rows):
        """From the nine digits that the tool prints; no text is NaN."""
        return [tuple(float32(math.nan if x == "" else float(x)) for x in row) for row in rows]

    def same(self, rows, expected):
        """As text, so that NaN equals NaN; one row at a time, for a short message."""
        self.assertEqual(len(rows), len(expected))
        for row, other in zip(rows, expected):
            self.assertEqual(str(row), str(other))

    def test_tessellate(self):
        """To the last bit the surface about the origin, but for its place; in every format."""
        for near, far in self.pairs():
            points, uvs, normals, triangles = self.surface(near)
            points, uvs, normals = self.put(self.floats(points)), *map(self.floats, (uvs, normals))
            parts = parse_obj(self.ok("tessellate", self.write(far), "-o", "-"))
            for part, expected in zip(parts, (points, uvs, normals)):
                self.same(self.floats(part), expected)
            self.same(parts[3], triangles)
            for name, parse in (("out.ply", parse_ply), ("out.glb", lambda d: parse_glb(d)[0])):
                self.ok("tessellate", "mesh.obj", "-o", name)
                parts = parse(self.read(name, "rb"))
                for part, expected in ((0, points), (2, normals), (3, triangles)):
                    self.same(parts[part], expected)

    def test_patches(self):
        for near, far in self.pairs():
            expected, patches = (json.loads(self.ok("patches", self.write(text)))["patches"]
                                 for text in (near, far))
            for a, b in zip(expected, patches):
                self.same(self.floats(b.pop("points")), self.put(self.floats(a.pop("points"))))
            self.same(patches, expected)

    def test_patches_of_schemes(self):
        """Points are moved, normals and marks are not."""
        places = {"pn_tri": 10, "pn_quad": 16, "npatch": 10, "hybrid": 18, "png1": 21,
                  "ribbon": 15, "ribbon_b2": 15}
        near, far = next(self.pairs())
        for scheme in SCHEMES[1:]:
            expected, patches = (json.loads(self.ok("patches", self.write(text), "--scheme",
                                                    scheme))["patches"] for text in (near, far))
            for a, b in zip(expected, patches):
                count, a, b = places[a["kind"]], *map(self.floats, (a["points"], b["points"]))
                self.same(b, self.put(a[:count]) + a[count:])

    def test_sample(self):
        for near, far in self.pairs():
            expected, rows = (self.floats(self.samples(text, "--curvature"))
                              for text in (near, far))
            self.same(rows, self.put(expected, 4))
            self.assertEqual({row[4:7] for row in rows}, set(self.floats(self.surface(far)[0])))

    def test_axes_apart(self):
        """Moved along x, a mesh keeps the very text of its y and z, signs of zeros included."""
        sheet = [(x - 1, y, -0.0) for x, y, z in grid(2, 2)[0]], grid(2, 2)[1]
        near, far = (self.samples(obj(moved(sheet, (by, -0.0, -0.0)))) for by in (0, 1000))
        self.assertIn("-0", [row[6] for row in near])
        self.assertEqual([row[5:] for row in far], [row[5:] for row in near])

    def test_normals(self):
        for mesh in (house(), ball(9, 6), torus(6, 5), OCTAHEDRON):
            for by in (self.BY, (1000, 1000, 1000), (0, -7, 1e6)):
                text = obj(moved(about_origin(jitter(mesh)), by))
                for rate in (8, 33):
                    result = json.loads(self.ok("check", self.write(text), "--json", "--rate",
                                                rate))
                    self.assertEqual((result["cracks"], result["degenerate_normals"]), (0, 0))
                    self.assertLess(result["max_normal_deg"], 0.001, by)

    def test_edges_meet(self):
        """Bits that are equal at the origin are equal where they are written."""
        for mesh in (house(), ball(9, 6), prism(6), grid(3, 2)):
            for by in (self.BY, (3, 0.3, -1e7), (-1e-3, 17, 2)):
                text = obj(moved(jitter(mesh), by))
                for rate in (1, 8):
                    csv = self.ok("sample", self.write(text), "--rate", rate)
                    samples = check_cracks.Samples(csv, mesh[1], rate)
                    pairs = check_cracks.shared_sides(mesh[1])
                    compared, cracks = check_cracks.compare(samples, mesh[1], pairs, self.fail)
                    self.assertGreaterEqual(compared, len(pairs) * (rate + 1))
                    self.assertEqual(cracks, 0)

    def test_details_beside_the_origin(self):
        """A sheet that gets finer towards the origin, outside its box, keeps its fine end."""
        _, faces = grid(20, 20)
        rng = random.Random(3)
        vertices = [(2.0 ** (i - 16), 2.0 ** (j - 16), 2.0 ** (min(i, j) - 16)
                     * rng.uniform(0.5, 1.5)) for i in range(21) for j in range(21)]
        result = json.loads(self.ok("check", self.write(obj((vertices, faces))), "--json"))
        self.assertLess(result["max_normal_deg"], 0.001)
        self.assertGreater(result["samples"] - result["degenerate_normals"], 3000)

    def test_ends_of_the_range(self):
        """The sum of two coordinates may overflow, and half of one may round to 0."""
        vertices, faces = CUBE
        for size, by in ((2.0 ** 105, 1.5 * 2.0 ** 127), (2.0 ** -149, 2.0 ** -147)):
            mesh = moved(([[size * x for x in p] for p in vertices], faces), (by, -by, by))
            patches = json.loads(self.ok("patches", self.write(obj(mesh))))["patches"]
            for p in itertools.chain(*(patch["points"] for patch in patches)):
                for x, t in zip(p, (by, -by, by)):
                    self.assertLessEqual(abs(float32(x) - t), size)


# ---- input ---------------------------------------------------------------------------------------

class Reader(ToolTest):
    def test_spellings(self):
        """Many ways to write one mesh."""
        plain = obj(house())
        expected = self.surface(plain)
        count = len(house()[0])
        start = plain.index("f ")
        points, faces = plain[:start], plain[start:]
        relative = re.sub(r"\d+", lambda n: str(int(n[0]) - count - 1), faces)
        cases = {
            "CR LF": plain.replace("\n", "\r\n"),
            "CR": plain.replace("\n", "\r"),
            "no last line break": plain.rstrip("\n"),
            "byte order mark": b"\xef\xbb\xbf" + plain.encode(),
            "comments": "# caf\u00e9 \\\n" + plain.replace("\n", " # \\ no continuation \\\n"),
            "blank lines and tabs": plain.replace("\n", "\n\n \t\n").replace(" ", "\t  "),
            "continuations": plain.replace(" ", " \\\n "),
            "continuations, CR LF": plain.replace(" ", " \\\n").replace("\n", "\r\n"),
            "long line": plain.replace("f 5 ", "f " + " " * 1000000 + "5 ", 1),
            "negative": points + relative,
            "faces first": faces + points,
            "groups": "mtllib a b.mtl\no thing\ng one two\ns off\nusemtl red\n" + plain
                      + "l 1 2 3\np 1\nvp 0.5\ncurv 0 1 \\\n 2 3\nend\n",
            "old faces": plain.replace("\nf ", "\nfo "),
            "weights and colours": re.sub("(v .*)", r"\1 1.0 0.5 0.25 1e-3", plain),
            "normals": points + "vn 0 0 1\nvn nan nan nan\n" + re.sub(r"(\d+)", r"\1//2", faces),
            "numbers": plain.replace(" -0.5\n", " -5e-1\n").replace(" 0.5\n", " +.5E0\n"),
        }
        for name, text in cases.items():
            with self.subTest(name):
                self.assertEqual(self.surface(text), expected)

    def test_standard_input(self):
        text = obj(house())
        expected = self.ok("tessellate", self.write(text), "-o", "-")
        self.assertEqual(self.ok("tessellate", "-", "-o", "-", data=text.encode()), expected)
        self.bad("info", "-", data=b"v 1 2 x\n", says="stdin:1: `x` is not a finite number")

    def test_decimal_comma(self):
        names = subprocess.run(["locale", "-a"], stdout=subprocess.PIPE).stdout.decode().split()
        commas = [n for n in names if n.startswith(("de_", "fr_", "nl_"))]
        if not commas:
            self.skipTest("no locale with a decimal comma here")
        self.write(obj(house()))
        for command in COMMANDS:
            options = ["-o", "-"] if command == "tessellate" else []
            run = lambda **o: self.ok(command, "mesh.obj", *options, **o)
            self.assertEqual(run(env=dict(os.environ, LC_ALL=commas[0])), run())


class Ply(ToolTest):
    BINARY = ("binary_little_endian", "binary_big_endian")

    def rows(self, data, *options, **more):
        return parse_csv(self.ok("sample", self.write(data, "mesh.ply"), *options, **more))[1]

    def test_formats_and_types(self):
        mesh = [tuple(map(float32, p)) for p in jitter(house())[0]], house()[1]
        expected = self.samples(obj(mesh))
        for form in ("ascii",) + self.BINARY:
            for coordinate in ("float", "double", "float32", "float64"):
                for index in ("char", "uint8", "short", "ushort", "int", "int32", "uint", "float",
                              "double"):
                    count = {"char": "int16", "int": "uchar", "float": "uint"}.get(index, index)
                    data = ply(mesh, form, coordinate, count, index)
                    self.assertEqual(self.rows(data), expected, (form, coordinate, index))

    def test_limit_positions(self):
        """Vertices of the surface, from the formula for the limit position."""
        mesh = jitter(house(), seed=3)
        for form in ("ascii",) + self.BINARY:
            self.write(ply(mesh, form, "double"), "in.ply")
            self.ok("tessellate", "in.ply", "-o", "out.ply", "--rate", 1)
            points = parse_ply(self.read("out.ply", "rb"))[0]
            for v in range(len(mesh[0])):
                p = limit_position(mesh, v)
                self.assertTrue(any(math.dist(p, q) < 1e-6 for q in points), (form, v))

    def test_integer_coordinates(self):
        signed = [tuple(100 * x for x in p) for p in CUBE[0]], CUBE[1]
        for type_ in ("char", "int16", "int"):
            for form in self.BINARY:
                self.assertEqual(self.rows(ply(signed, form, type_)), self.samples(obj(signed)))

    def test_spellings(self):
        mesh = house()
        expected = self.samples(obj(mesh))
        header, data = ply(mesh).split(b"end_header\n")
        cases = {
            "vertex_index": ply(mesh, list_name="vertex_index"),
            "CR LF": ply(mesh, line_break="\r\n"),
            "CR": ply(mesh, line_break="\r"),
            "binary, CR LF": ply(mesh, self.BINARY[0], line_break="\r\n"),
            "binary, CR": ply(mesh, self.BINARY[1], line_break="\r"),
            "blanks": ply(mesh).replace(b" ", b" \t "),
            "one line": header + b"end_header\n" + data.replace(b"\n", b" "),
            "a line each": header + b"end_header\n" + data.replace(b" ", b"\n"),
            "no last line break": ply(mesh).rstrip(b"\n"),
            "more behind": ply(mesh, self.BINARY[0]) + b"more",
            "order": ply(mesh, vertex_names="x y z nx ny nz red", extra=lambda v: (v, 2, 3, 255)),
        }
        for name, text in cases.items():
            with self.subTest(name):
                self.assertEqual(self.rows(text), expected)
        self.assertEqual(self.ok("sample", "-", data=ply(mesh)).splitlines()[1:],
                         [",".join(row) for row in expected])

    def test_lf_is_data(self):
        """Where lines end in CR, a first byte of 10 belongs to the data."""
        mesh = [(struct.unpack("<f", b"\n\0\0\x3f")[0], 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
        data = ply(mesh, self.BINARY[0], line_break="\r")
        self.assertIn(b"end_header\r\n", data)
        self.assertEqual(self.rows(data), self.samples(obj(mesh)))

    def test_skipped(self):
        """Elements and properties that nobody asked for, between those that count."""
        mesh = CUBE
        for form in self.BINARY + ("ascii",):
            order = {"binary_big_endian": ">"}.get(form, "<")
            text = "ply\nformat %s 1.0\n" % form
            text += ("element junk 2\nproperty list uchar double a\nproperty ushort b\n"
                     "element nothing 4000000000\n"
                     "element face 6\nproperty uchar flag\n"
                     "property list uint ushort vertex_indices\n"
                     "property list uchar float texcoord\n"
                     "element vertex 8\nproperty list char int x\nproperty double y\n"
                     "property float x\nproperty uint q\nproperty short z\n"
                     "end_header\n")
            rows = [("B3dH", (3, 1e300, 2, 3, 7)), ("BH", (0, 65535))]
            rows += [("BI4HB2f", (1, 4, *f, 2, 0.5, 7)) for f in mesh[1]]
            rows += [("b2idfIh", (2, -1, 1, y, x, 4294967295, z)) for x, y, z in mesh[0]]
            if form == "ascii":
                data = "\n".join(" ".join(map(str, row)) for _, row in rows).encode() + b"\n"
                data = data.replace(b"1e+300", b"nan")
            else:
                data = b"".join(struct.pack(order + letters, *row) for letters, row in rows)
            self.assertEqual(self.rows(text.encode() + data), self.samples(obj(mesh)), form)

    def test_texture(self):
        mesh = house()
        uv = lambda v: (mesh[0][v][0] / 2, mesh[0][v][1] / 4)
        text = Texture.textured(mesh, lambda f, i: uv(mesh[1][f][i]))
        expected = self.surface(text)
        for names in ("s t", "u v", "texture_u texture_v"):
            for form in ("ascii", "binary_big_endian"):
                self.write(ply(mesh, form, "double", vertex_names="x y z " + names, extra=uv),
                           "in.ply")
                self.assertEqual(parse_obj(self.ok("tessellate", "in.ply", "-o", "-")), expected)
        self.write(ply(mesh, vertex_names="x y z s", extra=lambda v: (1,)), "in.ply")
        self.assertEqual(parse_obj(self.ok("tessellate", "in.ply", "-o", "-"))[1], [])

    def test_round_trip(self):
        """What tessellate writes can be read again: a PLY of triangles like the OBJ."""
        self.write(obj(house()))
        for name in ("out.ply", "out.obj"):
            self.ok("tessellate", "mesh.obj", "-o", name, "--rate", 2)
        self.assertEqual(self.ok("sample", "out.ply"), self.ok("sample", "out.obj"))

    HEADER = ("ply\nformat %s 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
              "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
              "end_header\n")
    ASCII, LITTLE = HEADER % "ascii", (HEADER % "binary_little_endian").encode()
    CORNERS, FLOATS = "0 0 0\n1 0 0\n0 1 0\n", struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    CASES = [
        ("ply\n", r"2: the file ends in its header"),
        ("ply\nformat ascii 1.0\n", r"3: the file ends in its header"),
        ("ply\nformat ascii 1.0\nend_header", r"3: the file ends in its header"),
        ("ply\nend_header\n", r"2: the header names no format"),
        ("ply\nformat binary 1.0\n", r"2: `binary` is not a format of PLY files"),
        ("ply\nformat ascii 1.0\nend_header\n", r"3: there are no vertices with x, y and z"),
        (ASCII.replace("face 1", "face 0") + CORNERS, r"12: the file has no faces"),
        (ASCII.replace("face 1", "tristrips 1"), r"9: there are no faces"),
        (ASCII.replace("_indices", "_colours"), r"9: there are no faces with a list vertex_ind"),
        (ASCII.replace("list uchar int", "int"), r"9: there are no faces with a list vertex_ind"),
        (ASCII.replace("float z", "float w"), r"9: there are no vertices with x, y and z"),
        (ASCII.replace("element vertex 3", "element vertices 3"), r"9: there are no vertices"),
        (ASCII.replace("vertex 3", "vertex -3"), r"3: `-3` is not a number of elements"),
        (ASCII.replace("vertex 3", "vertex"), r"3: the end of the line is not a number of el"),
        (ASCII.replace("vertex 3", "vertex 4294967295"), r"3: `4294967295` is not a number of"),
        (ASCII.replace("element face", "element vertex"), r"7: `vertex` is there twice"),
        (ASCII.replace("element vertex 3\n", ""), r"3: property without an element"),
        (ASCII.replace("float y", "half y"), r"5: `half` is not a type"),
        (ASCII.replace("list uchar", "list"), r"8: `vertex_indices` is not a type"),
        (ASCII.replace("float y", "float y\nproprety"), r"6: `proprety` does not belong"),
        (ASCII, r"10: the file ends before its data"),
        (ASCII + CORNERS + "3 0 1\n", r"14: the file ends before its data"),
        (ASCII + CORNERS.replace("1", "x", 1), r"11: `x` is not a finite number"),
        (ASCII + CORNERS.replace("1", "nan", 1), r"11: `nan` is not a finite number"),
        (ASCII + CORNERS.replace("1", "1e39", 1), r"11: `1e39` is not a finite number"),
        (ASCII + CORNERS + "3 0 1 3\n", r"13: face refers to vertex 3, counting from 0, the file "
         r"has 3"),
        (ASCII + CORNERS + "3 0 1 -1\n", r"13: .*not a whole number"),
        (ASCII + CORNERS + "3 0 1 1.5\n", r"13: .*not a whole number"),
        (ASCII + CORNERS + "3 0 1 4294967296\n", r"13: .*not a whole number"),
        (ASCII + CORNERS + "2 0 1\n", r"13: face has 2 corners"),
        (ASCII + CORNERS + "3 0 1 1\n", r"13: .*twice.*vertex 1$"),
        (ASCII.replace("face 1", "face 2") + CORNERS + "3 0 1 2\n3 0 1 2\n",
         r"1[34]: .*same direction.*vertices \d and \d"),
        (LITTLE, r" vertex 0, counting from 0: the file ends before its data"),
        (LITTLE + FLOATS[:-1], r" vertex 2, counting from 0: the file ends"),
        (LITTLE + FLOATS + b"\3" + 2 * b"\1\0\0\0", r" face 0, counting from 0: the file ends"),
        (LITTLE + FLOATS + b"\2" + bytes(8), r" face 0, counting from 0: face has 2 corners"),
        (LITTLE + FLOATS + b"\3" + bytes(12), r" face 0, counting from 0: .*twice.*vertex 0$"),
        (LITTLE + FLOATS + b"\3" + 12 * b"\1", r" face 0, counting from 0: face refers to vertex "
         r"16843009, counting from 0, the file has 3"),
        (LITTLE + FLOATS + b"\3" + 12 * b"\xff", r" face 0, .*not a whole number"),
        (LITTLE + struct.pack("<f", math.nan) + FLOATS[4:], r" vertex 0, .*not a finite number"),
        (LITTLE + FLOATS[:32] + struct.pack("<f", -math.inf), r" vertex 2, .*not a finite number"),
        (LITTLE.replace(b"uchar int", b"char int") + FLOATS + b"\xff", r" face 0, .*not a whole"),
        (LITTLE.replace(b"uchar int", b"uint int") + FLOATS + b"\xf0\xff\xff\xff" + bytes(99),
         r" face 0, counting from 0: the file ends"),
    ]

    def test_bad(self):
        for text, says in self.CASES:
            with self.subTest(says):
                self.write(text, "mesh.ply")
                self.bad("tessellate", "mesh.ply", "-o", "out.glb", says="mesh.ply:" + says)


class BadInput(ToolTest):
    TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    CASES = [
        ("", r"1: .*no faces"),
        ("# nothing\n\n", r"3: .*no faces"),
        ("v 0 0 0\n", r"2: .*no faces"),
        ("plywood\n", r"2: .*no faces"),
        (b"glTF\x02\0\0\0\x10\0\0\0", r"1: .*not a Wavefront OBJ"),
        (b"\0" * 100, r"1: .*not a Wavefront OBJ"),
        (bytes(range(255, 127, -1)), r"1: .*not a Wavefront OBJ"),
        (b"v 0 0 0\n\x89PNG\r\n", r"2: .*not a Wavefront OBJ"),
        ("v 1 2\n", r"1: the end of the line is not a finite number"),
        ("v 1 2 x\n", r"1: `x` is not a finite number"),
        ("v 1 2 1,5\n", r"1: `1,5` is not a finite number"),
        ("v 1 nan 3\n", r"1: `nan` is not a finite number"),
        ("v inf 0 3\n", r"1: `inf` is not a finite number"),
        ("v 0x10 0 3\n", r"1: `0x10` is not a finite number"),
        ("v 0 0 1e39\n", r"1: `1e39` is not a finite number"),
        ("v 0 0 " + "9" * 100000 + "\n", r"1: `9{38}\.\.\.` is not a finite number"),
        (b"v 0 0 1\x002\n", r"1: `1\?2` is not a finite number"),
        ("vt\n", r"1: the end of the line is not a finite number"),
        ("\\\n\\\nv 1 \\\n 2 \\\n z\n", r"3: `z` is not"),
        (TRIANGLE + "f 1 2 4\n", r"4: face refers to vertex 4, the file has 3"),
        (TRIANGLE + "f 1 2 3\nf 1 2 9\nf 1 2 8\n", r"5: face refers to vertex 9, the file has 3"),
        (TRIANGLE + "f 1 2 99999999999\n", r"4: face refers to vertex 99999999999, the file has 3"),
        (TRIANGLE + "f 1 2 4294967297\n", r"4: face refers to vertex 4294967297, the file has 3"),
        (TRIANGLE + "f 1 2 " + "9" * 30 + "\n", r"4: face refers to vertex \d+, the file has 3"),
        (TRIANGLE + "f 1 2 0\n", r"4: face refers to vertex 0, the file has 3"),
        (TRIANGLE + "f 1 2 -4\n", r"4: face refers to vertex -4, the file has 3"),
        (TRIANGLE + "f 1 2 -" + "9" * 30 + "\n", r"4: face refers to vertex -\d+, the file has 3"),
        (TRIANGLE + "f 1/1 2/1 3/1\n", r"4: face refers to texture coordinate 1, the file has 0"),
        (TRIANGLE + "vn 0 0 1\nf 1//1 2//1 3//2\n", r"5: face refers to normal 2, the file has 1"),
        (TRIANGLE + "f 1 2 3x\n", r"4: `3x` is not a face corner"),
        (TRIANGLE + "f 1 2 3/1/1/1\n", r"4: `3/1/1/1` is not a face corner"),
        (TRIANGLE + "f 1 2 /3\n", r"4: `/3` is not a face corner"),
        (TRIANGLE + "f 1 2 -\n", r"4: `-` is not a face corner"),
        (TRIANGLE + "f 1.5 2 3\n", r"4: `1.5` is not a face corner"),
        (TRIANGLE + "f 1 2\n", r"4: face has 2 corners"),
        (TRIANGLE + "f\n", r"4: face has 0 corners"),
        (TRIANGLE + "f" + " 1" * 65536 + "\n", r"4: face has 65536 corners"),
        (TRIANGLE + "f 1 2 1\n", r"4: .*twice.*vertex 1"),
        (TRIANGLE + "f 1 2 3\nf 1 2 3\n", r"[45]: .*same direction.*vertices \d and \d"),
        (TRIANGLE + "f 1 2 3\nf 3 2 1\nf 1 2 3\n", r"[456]: .*two faces"),
        (obj(CUBE, "t crease 2/1/0 0 7 1\n"), r"15: crease tag.* names no edge: 0 7"),
        (obj(CUBE, "t crease 2/1/0 1 1 1\n"), r"15: crease tag.* names no edge: 1 1"),
        (obj(CUBE, "t crease 2/1/0 0 8 1\n"), r"15: crease tag.*vertex 8, the file has 8"),
        (obj(CUBE, "t crease 2/1/0 0 -1 1\n"), r"15: `-1` is not a whole number"),
        (obj(CUBE, "t crease 2/1/0 0 1\n"), r"15: the end of the line is not a finite number"),
        (obj(CUBE, "t crease 2/1/0 0 1 nan\n"), r"15: `nan` is not a finite number"),
        (obj(CUBE, "t crease 3/1/0 0 1 2 1\n"), r"15: crease tag needs"),
        (obj(CUBE, "t crease 4/3/0 0 1 2 3 1 1 1\n"), r"15: crease tag needs"),
        (obj(CUBE, "t crease 99999999998/1/0 0 1 2 1\n"), r"15: the end of the line is not"),
        (obj(CUBE, "t crease 2/1\n"), r"15: `2/1` is not a tag's three counts"),
        (obj(CUBE, "t\n"), r"15: the end of the line is not a tag's three counts"),
        (obj(CUBE, "t corner 1/1/0 8 10\n"), r"15: corner tag.*vertex 8, the file has 8"),
        (obj(CUBE, "t corner 0/0/0\n"), r"15: corner tag needs vertices"),
        (obj(CUBE, "t corner 3/2/0 0 1 2 1 1\n"), r"15: corner tag needs vertices"),
        (obj(CUBE, "t corner 2/1/0 0 1\n"), r"15: the end of the line is not a finite number"),
        (obj(CUBE, "t interpolateboundary 1/0/0 3\n"), r"15: interpolateboundary takes"),
    ]

    def test_each(self):
        for text, says in self.CASES:
            with self.subTest(says):
                self.write(text)
                for command in (("tessellate", "-o", "out.glb"), ("check",)):
                    self.bad(command[0], "mesh.obj", *command[1:], says="mesh.obj:" + says)

    def test_every_command(self):
        self.write("v 1 2 x\n")
        for command in COMMANDS:
            options = ["-o", "out.obj"] if command in ("tessellate", "patches", "sample") else []
            self.bad(command, "mesh.obj", *options, says="mesh.obj:1: `x` is not a finite number")

    def test_no_file(self):
        self.bad("info", "none.obj", says="none.obj: cannot open the file: ")
        self.bad("info", ".", says=r"\.: cannot read the file: ")

    def test_junk(self):
        """Whatever the bytes: an answer or one line, never a crash, never half a file."""
        rng = random.Random(7)
        seeds = [obj(house(), "vt 0 1\nt crease 2/1/0 0 1 2\nvn 0 0 1\n"),
                 re.sub(r"f (\d+) (\d+)", r"f \1/1/1 -\2//1", obj(CUBE, "vt 0 0\nvn 0 0 1\n")),
                 obj(PILLOWS, creases([(0, 1), (1, 2)]) + "t corner 1/1/0 1 10\n")]
        seeds = [text.encode() for text in seeds]
        seeds += [ply(house(), form, vertex_names="x y z " + names, extra=lambda v: (v, 1, 1)[:n])
                  for form in ("ascii",) + Ply.BINARY for names, n in (("s t", 2), ("nx ny nz", 3))]
        words = [b"1", b"7", b"3", b".5", b" ", b"-", b"/", b"1e38", b"nan", b"\0", b"\\\n", b"\r",
                 b"4294967296", b"-1", b"f ", b"t ", b"0", b"\n", b"v 1 1 1\n", b"\xff", b"#",
                 b"property list uchar int s\n", b"element face 9\n", b"double", b"\0\0\x80\x7f"]
        outcomes = Counter()
        for _ in range(500):
            data = bytearray(rng.choice(seeds))
            for _ in range(rng.choice((1, 1, 2, 20))):
                at = rng.randrange(len(data))
                data[at:at + rng.randrange(3)] = rng.choice(words)
            self.write(bytes(data))
            done = self.run_tool("tessellate", "mesh.obj", "-o", "out.glb", "--rate", 2, "--scheme",
                                 rng.choice(SCHEMES))
            outcomes[done.returncode] += 1
            self.assertIn(done.returncode, (0, 2), (bytes(data), done.stderr))
            problems = [line for line in done.stderr.split(b"\n")[:-1] if b"warning" not in line]
            self.assertEqual(len(problems), done.returncode // 2, done.stderr)
            self.assertEqual(sorted(os.listdir(self.folder)),
                             ["mesh.obj"] + ["out.glb"] * (not done.returncode))
            if not done.returncode:
                parse_glb(self.read("out.glb", "rb"))
                os.remove(self.path("out.glb"))
        self.assertTrue(outcomes[0] > 20 and outcomes[2] > 100, outcomes)


# ---- output, command line ------------------------------------------------------------------------

class Output(ToolTest):
    def test_file_or_standard_output(self):
        self.write(obj(house()))
        for command in ("patches", "sample"):
            text = self.ok(command, "mesh.obj")
            self.assertEqual(self.ok(command, "mesh.obj", "-o", "-"), text)
            self.assertEqual(self.ok(command, "mesh.obj", "-o", "out"), "")
            self.assertEqual(self.read("out"), text)

    def test_replaces_when_complete(self):
        self.write(obj(CUBE))
        self.write("old", "out.obj")
        self.write("mine", "out.obj.tmp0")
        self.bad("tessellate", "none.obj", "-o", "out.obj", says="none.obj")
        self.assertEqual(self.read("out.obj"), "old")
        self.ok("tessellate", "mesh.obj", "-o", "out.obj")
        self.assertEqual(len(parse_obj(self.read("out.obj"))[0]), 6 * 64 + 2)
        self.assertEqual(self.read("out.obj.tmp0"), "mine")
        self.assertEqual(len(os.listdir(self.folder)), 3)

    def test_unwritable(self):
        self.write(obj(CUBE))
        os.mkdir(self.path("dir.obj"))
        self.bad("tessellate", "mesh.obj", "-o", "none/out.obj", says="none/out.obj: cannot write")
        self.bad("tessellate", "mesh.obj", "-o", "dir.obj", says="dir.obj: cannot write")

    def test_full_disk(self):
        """A limit on file size stands in for a disk that fills up on the way."""
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))
        self.write(obj(CUBE))
        for out in ("out.obj", "out.glb", "out.csv"):
            command = "sample" if out == "out.csv" else "tessellate"
            self.bad(command, "mesh.obj", "-o", out, "--rate", "64", preexec_fn=limit,
                     says=out + ": cannot write")
        if os.path.exists("/dev/full"):
            for command in ("patches", "sample"):
                self.bad(command, "mesh.obj", "-o", "/dev/full", says="/dev/full: cannot write")
            with open("/dev/full", "wb") as full:
                for command in COMMANDS:
                    done = subprocess.run([TOOL, command, self.path("mesh.obj"), *(
                        ["-o", "-"] if command == "tessellate" else [])], stdout=full,
                        stderr=subprocess.PIPE)
                    self.assertEqual(done.returncode, 2)
                    self.assertRegex(done.stderr.decode(), "^stdout: cannot write: .*\n$")
            self.assertTrue(os.path.exists("/dev/full"))

    def test_interrupted(self):
        self.write(obj(CUBE))
        for pause in (0, 0.1):
            running = subprocess.Popen([TOOL, "tessellate", "mesh.obj", "-o", "out.obj", "--rate",
                                        "700"], cwd=self.folder)
            deadline = time.monotonic() + 60
            while len(os.listdir(self.folder)) < 2 and time.monotonic() < deadline:
                pass
            self.assertEqual(sorted(os.listdir(self.folder)), ["mesh.obj", "out.obj.tmp0"])
            time.sleep(pause)
            running.send_signal(signal.SIGINT)
            self.assertEqual(running.wait(60), -signal.SIGINT)
            self.assertEqual(os.listdir(self.folder), ["mesh.obj"])

    def test_progress_bar(self):
        """On a terminal, for work that takes a while; not with --quiet."""
        self.write(obj(CUBE))
        shown = {}
        for options in ((), ("--quiet",)):
            ours, theirs = pty.openpty()
            running = subprocess.Popen([TOOL, "tessellate", "mesh.obj", "-o", "out.obj", "--rate",
                                        "350", *options], cwd=self.folder, stderr=theirs)
            os.close(theirs)
            text = b""
            try:
                while True:
                    text += os.read(ours, 4096)
            except OSError:                 # the other end is closed
                pass
            os.close(ours)
            self.assertEqual(running.wait(), 0)
            shown[options] = text
        self.assertRegex(shown[()], rb"^\r\[#* *\] +\d+ %")
        self.assertTrue(shown[()].endswith(b"\r\033[K"))
        self.assertEqual(shown[("--quiet",)], b"")


class CommandLine(ToolTest):
    def test_help_and_version(self):
        overview = self.ok("--help")
        for command in COMMANDS:
            self.assertIn("\n    " + command + " ", overview)
            text = self.ok(command, "--help")
            self.assertTrue(text.startswith("Usage: patchsurf %s MESH" % command))
            self.assertGreaterEqual(text.count("\n    patchsurf %s " % command), 2)
            for option in ("--scheme", "--rate", "--blend", "--crease-angle", "--normals",
                           "--variant", "--sigma", "--coons", "--folds", "--nearly-flat", "--plane",
                           "--shading", "--quiet", "--help", "--version"):
                self.assertIn("\n    " + option + " ", text)
            self.assertEqual("--json " in text.split("Options:")[1], command in ("info", "check"))
            self.assertEqual("--curvature " in text.split("Options:")[1], command == "sample")
            self.assertTrue(all(len(line) <= 100 for line in text.splitlines()))
        self.assertIn("\n    report ", overview)
        text = self.ok("report", "--help")
        self.assertTrue(text.startswith("Usage: patchsurf report TABLE [MESH]"))
        self.assertGreaterEqual(text.count("\n    patchsurf report "), 2)
        for word in ("sphere", "torus", "curvature", "costs", "patches", "--step", "--json",
                     "--svg", "--scheme", "--normals", "--quiet", "--help", "--version"):
            self.assertIn("\n    " + word + " ", text)
        version = self.ok("--version")
        self.assertRegex(version, r"^patchsurf \d+\.\d+\.\d+\n$")
        for command in COMMANDS + ("report",):
            self.assertEqual(self.ok(command, "--version"), version)

    def test_bad_usage(self):
        self.write(obj(CUBE))
        for arguments, says in (
                (["frobnicate"], "unknown command frobnicate"),
                (["info"], "info needs a mesh"),
                (["info", "mesh.obj", "mesh.obj"], "one mesh at a time"),
                (["info", "mesh.obj", "--jsn"], "info has no option --jsn"),
                (["info", "mesh.obj", "--curvature"], "info has no option --curvature"),
                (["info", "mesh.obj", "--normals", "flat"], "--normals takes input, average"),
                (["info", "mesh.obj", "--json=1"], "--json takes no value"),
                (["info", "mesh.obj", "--rate"], "--rate needs a value"),
                (["info", "mesh.obj", "--scheme", "WM"], "unknown scheme WM; there are wm, pm, pn"),
                (["info", "mesh.obj", "--scheme", "mixed"], "unknown scheme mixed"),
                (["tessellate", "mesh.obj"], "tessellate needs -o OUT"),
                *((["info", "mesh.obj", "--rate", r], "--rate takes a whole number")
                  for r in ("0", "-1", "1.5", "16385", "99999999999999999999", "x", "")),
                *((["info", "mesh.obj", "--blend", a], "--blend takes a number")
                  for a in ("-0.1", "1.001", "nan", "", "x", "0.5x")),
                *((["info", "mesh.obj", "--crease-angle", a], "--crease-angle takes degrees")
                  for a in ("-1", "181", "nan", "", "30deg"))):
            self.bad(*arguments, says="patchsurf: " + says)
        for name in ("out.stl", "out", "obj"):
            self.bad("tessellate", "mesh.obj", "-o", name, says=name + ": unknown output format")
        done = self.run_tool()
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        self.assertIn(b"Usage: ", done.stderr)

    def test_option_spellings(self):
        self.write(obj(CUBE))
        text = self.ok("sample", "mesh.obj", "--rate", "3", "--scheme", "pm")
        for normals in ("input", "average", "average-area", "limit"):   # pm takes none
            self.assertEqual(self.ok("sample", "mesh.obj", "--rate", "3", "--normals", normals),
                             text)
        self.assertEqual(self.ok("sample", "--rate=3", "--scheme=pm", "mesh.obj", "-o=-"), text)
        self.assertEqual(len(text.splitlines()), 1 + 6 * 16)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
