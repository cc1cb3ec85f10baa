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
from collections import Counter

TOOL = os.path.abspath(sys.argv[1]) if len(sys.argv) > 1 else "build/patchsurf"
COMMANDS = ("info", "tessellate", "patches", "sample", "check")


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
OCTAHEDRON = ([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)],
              [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4),
               (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])


def jitter(mesh, seed=1, size=0.1):
    rng = random.Random(seed)
    return [tuple(x + rng.uniform(-size, size) for x in p) for p in mesh[0]], mesh[1]


def obj(mesh, extra=""):
    lines = ["v %r %r %r" % tuple(map(float, p)) for p in mesh[0]]
    lines += ["f " + " ".join(str(v + 1) for v in face) for face in mesh[1]]
    return "\n".join(lines) + "\n" + extra


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
                self.assertEqual(info["control_points"],
                                 sum(info[kind] * count for kind, count in points.items()))
                self.assertGreater(info["bytes"], 12 * info["control_points"])
                keys = ("vertices faces edges boundary_edges hard_edges components max_valence "
                        "ordinary polar p3 p4 p5 ngon valence2 control_points bytes").split()
                if name == "octahedron":
                    keys += "cos_mean cos_std cos_min cos_max convex concave inflection".split()
                self.assertEqual(list(info), keys)
                text = dict(line.split() for line in self.ok("info", "mesh.obj").splitlines())
                self.assertEqual({key: float(value) for key, value in text.items()}, info)

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

        minus = lambda p, q: [x - y for x, y in zip(p, q)]
        dot = lambda p, q: sum(x * y for x, y in zip(p, q))
        unit = lambda p: [x / math.sqrt(dot(p, p)) for x in p]
        cross = lambda a, b: [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                              a[0] * b[1] - a[1] * b[0]]
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
                                                 / len(cosines))).items():
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
        inside = {3: (rate - 1) * (rate - 2) // 2, 4: (rate - 1) ** 2,
                  5: 5 * rate * (rate - 1) // 2 + 1}
        count = {3: rate ** 2, 4: 2 * rate ** 2, 5: 5 * rate ** 2}
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
        for mesh in (CUBE, OCTAHEDRON, torus(5, 4), ball(6, 4), house()):
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
        for vertex, p in enumerate(mesh[0]):
            rings = [(f, f.index(vertex)) for f in mesh[1] if vertex in f]
            n, v = len(rings), [0, 0, 0]
            for face, i in rings:
                at = lambda k: mesh[0][face[(i + k) % len(face)]]
                for k in range(3):
                    f = (4 * p[k] + 2 * (at(1)[k] + at(-1)[k]) + (at(2)[k] + at(-2)[k]) / 2) / 9
                    v[k] += (9 * f + (n - 4) * p[k]) / (n * (n + 5))
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
    def textured(self, mesh, uv_of):
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
        mesh = house()
        for rate in (1, 3, 8):
            step = lambda i: float32(i / rate)
            expected = []
            for f, face in enumerate(mesh[1]):
                for sector in range(len(face) if len(face) > 4 else 1):
                    for v in range(rate + 1):
                        row = rate + 1 if len(face) == 4 else rate + 1 - v
                        expected += [(f, sector, step(u), step(v)) for u in range(row)]
            self.write(obj(mesh))
            header, rows = parse_csv(self.ok("sample", "mesh.obj", "--rate", rate))
            self.assertEqual(header, "face sector u v x y z nx ny nz".split())
            self.assertEqual([(int(r[0]), int(r[1]), float32(float(r[2])), float32(float(r[3])))
                              for r in rows], expected)

    def test_same_bits_as_tessellation(self):
        for mesh in (house(), ball(5, 4), jitter(OCTAHEDRON)):
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
        mesh, rate, sides = jitter(house()), 5, {}
        for face, sector, u, v, *rest in self.samples(obj(mesh), "--rate", rate):
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

    def test_not_finite(self):
        vertices, faces = CUBE
        text = obj(([[3e38 * x for x in p] for p in vertices], faces))
        self.assertIn(None, itertools.chain(*(q for p in self.patches(text) for q in p["points"])))
        result = json.loads(self.ok("check", "mesh.obj", "--json", status=1))
        self.assertGreater(result["nonfinite"], 0)
        self.bad("tessellate", "mesh.obj", "-o", "out.obj", says="mesh.obj: .*not finite")


class Check(ToolTest):
    KEYS = ["samples", "cracks", "max_normal_deg", "sharp_edges", "nonfinite", "degenerate_normals",
            "worst_face"]

    def check(self, text, *options):
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

    def test_text(self):
        result = self.check(obj(CUBE))
        text = dict(line.split() for line in self.ok("check", "mesh.obj").splitlines())
        self.assertEqual({key: float(value) for key, value in text.items()}, result)


class Blend(ToolTest):
    """Creases of OpenSubdiv's tags, and --blend."""

    def tags(self, sharpness, edges=None):
        return "".join("t crease 2/1/0 %d %d %s\n" % (*sorted(e), sharpness)
                       for e in edges or edges_of(CUBE[1]))

    def test_crease_is_a_blend_ratio(self):
        for s in ("0.5", "1", "2.75", "9.99"):
            ratio = repr(2 / 3 * 2 ** -float(s))
            self.assertEqual(self.surface(obj(CUBE, self.tags(s))),
                             self.surface(obj(CUBE), "--blend", ratio))

    def test_default(self):
        plain = self.surface(obj(CUBE))
        self.assertEqual(self.surface(obj(CUBE), "--blend", repr(2 / 3)), plain)
        self.assertEqual(self.surface(obj(CUBE, self.tags("0")), "--blend", "0.1"), plain)
        self.assertEqual(self.surface(obj(CUBE, self.tags("-3"))), plain)
        self.assertNotEqual(self.surface(obj(CUBE), "--blend", "0.1"), plain)

    def test_one_edge(self):
        (a, b) = edge = (0, 1)
        one = self.surface(obj(CUBE, self.tags("3", [edge])))
        self.assertNotEqual(one, self.surface(obj(CUBE)))
        for other in ("t crease 2/1/0 1 0 3\n",                    # either direction
                      "t crease 2/1/0 0 1 1\nt crease 2/1/0 1 0 3\n",   # the last one counts
                      "t crease 4/2/0 0 1 2 3 3 0\n",              # one sharpness for each edge
                      "t crease 4/1/0 0 1 1 0 3 # as above\n"):
            self.assertEqual(self.surface(obj(CUBE, other)), one, other)

    def test_tags_without_effect(self):
        plain = self.surface(obj(CUBE))
        for value in (0, 1, 2):
            extra = "t interpolateboundary 1/0/0 %d\n" % value
            self.assertEqual(self.surface(obj(CUBE, extra)), plain)
        for extra in ("t corner 1/1/0 0 10.0\n", "t corner 1/1/0 7 2.5\nt corner 2/2/0 1 2 3 4\n",
                      "t hole 1/0/0 1\n", "t creasemethod 0/0/1 chaikin\n"):
            self.assertEqual(self.surface(obj(CUBE, extra), warnings=1), plain)
            self.assertEqual(self.surface(obj(CUBE, extra), "--quiet"), plain)


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


class BadInput(ToolTest):
    TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    CASES = [
        ("", r"1: .*no faces"),
        ("# nothing\n\n", r"3: .*no faces"),
        ("v 0 0 0\n", r"2: .*no faces"),
        ("ply\nformat ascii 1.0\n", r"1: .*PLY"),
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
        (TRIANGLE + "f 1 2 3\n", r"4: .*closed.*vertices \d and \d"),
        (TRIANGLE + "f 1 2 3\nf 1 2 3\n", r"[45]: .*same direction.*vertices \d and \d"),
        (TRIANGLE + "f 1 2 3\nf 3 2 1\nf 1 2 3\n", r"[456]: .*two faces"),
        (obj(prism(6)), r"13: .*six corners"),
        (obj(CUBE, "t crease 2/1/0 0 1 10\n"), r"15: sharpness 10 .*hard edge"),
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
                 re.sub(r"f (\d+) (\d+)", r"f \1/1/1 -\2//1", obj(CUBE, "vt 0 0\nvn 0 0 1\n"))]
        words = [b"1", b"7", b"3", b".5", b" ", b"-", b"/", b"1e38", b"nan", b"\0", b"\\\n", b"\r",
                 b"4294967296", b"-1", b"f ", b"t ", b"0", b"\n", b"v 1 1 1\n", b"\xff", b"#"]
        outcomes = Counter()
        for _ in range(300):
            data = bytearray(rng.choice(seeds).encode())
            for _ in range(rng.choice((1, 1, 2, 20))):
                at = rng.randrange(len(data))
                data[at:at + rng.randrange(3)] = rng.choice(words)
            self.write(bytes(data))
            done = self.run_tool("tessellate", "mesh.obj", "-o", "out.glb", "--rate", 2)
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
            for option in ("--scheme", "--rate", "--blend", "--quiet", "--help"):
                self.assertIn("\n    " + option + " ", text)
            self.assertEqual("--json " in text.split("Options:")[1], command in ("info", "check"))
            self.assertEqual("--curvature " in text.split("Options:")[1], command == "sample")
            self.assertTrue(all(len(line) <= 100 for line in text.splitlines()))
        self.assertRegex(self.ok("--version"), r"^patchsurf \d+\.\d+\.\d+\n$")

    def test_bad_usage(self):
        self.write(obj(CUBE))
        for arguments, says in (
                (["frobnicate"], "unknown command frobnicate"),
                (["report", "sphere"], "unknown command report"),
                (["info"], "info needs a mesh"),
                (["info", "mesh.obj", "mesh.obj"], "one mesh at a time"),
                (["info", "mesh.obj", "--jsn"], "info has no option --jsn"),
                (["info", "mesh.obj", "--curvature"], "info has no option --curvature"),
                (["info", "mesh.obj", "--normals", "limit"], "info has no option --normals"),
                (["info", "mesh.obj", "--json=1"], "--json takes no value"),
                (["info", "mesh.obj", "--rate"], "--rate needs a value"),
                (["info", "mesh.obj", "--scheme", "wm"], "unknown scheme wm"),
                (["tessellate", "mesh.obj"], "tessellate needs -o OUT"),
                *((["info", "mesh.obj", "--rate", r], "--rate takes a whole number")
                  for r in ("0", "-1", "1.5", "16385", "99999999999999999999", "x", "")),
                *((["info", "mesh.obj", "--blend", a], "--blend takes a number")
                  for a in ("-0.1", "1.001", "nan", "", "x", "0.5x"))):
            self.bad(*arguments, says="patchsurf: " + says)
        for name in ("out.ply", "out.stl", "out", "obj"):
            self.bad("tessellate", "mesh.obj", "-o", name, says=name + ": unknown output format")
        done = self.run_tool()
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        self.assertIn(b"Usage: ", done.stderr)

    def test_option_spellings(self):
        self.write(obj(CUBE))
        text = self.ok("sample", "mesh.obj", "--rate", "3", "--scheme", "pm")
        self.assertEqual(self.ok("sample", "--rate=3", "--scheme=pm", "mesh.obj", "-o=-"), text)
        self.assertEqual(len(text.splitlines()), 1 + 6 * 16)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
