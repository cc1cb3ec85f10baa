#!/usr/bin/env python3
"""Models the sample meshes and writes them as OBJ files beside this program (or into a folder
given as its only argument). Needs Python 3 and nothing else; the same files come out every time.

Every mesh is closed and made of triangles, quads and pentagons, counter-clockwise seen from
outside. What is written is verified first, and an offence ends the program.
"""
import math
import os
import sys


# ---- modelling kit -------------------------------------------------------------------------------

class Model:
    """Points and faces. Faces may be entered in either winding: finish() turns them outward."""

    def __init__(self):
        self.points, self.faces = [], []

    def row(self, points):
        """Enters points; returns their indices."""
        first = len(self.points)
        self.points += [tuple(map(float, p)) for p in points]
        return list(range(first, len(self.points)))

    def bridge(self, a, b):
        """Quads between two rows with the same number of points."""
        for i in range(len(a) - 1):
            self.faces.append([a[i], a[i + 1], b[i + 1], b[i]])

    def bridge_pentagons(self, fine, coarse):
        """One pentagon for every edge of the coarse row, with two edges of the fine row."""
        for i in range(len(coarse) - 1):
            self.faces.append([coarse[i], coarse[i + 1], *fine[2 * i + 2:2 * i:-1], fine[2 * i]])

    def bridge_triangles(self, fine, coarse):
        """One quad and one triangle for every edge of the coarse row, in alternating order."""
        for i in range(len(coarse) - 1):
            c, d = coarse[i], coarse[i + 1]
            e, f, g = fine[2 * i:2 * i + 3]
            if i % 2 == 0:
                self.faces += [[c, d, f, e], [d, g, f]]
            else:
                self.faces += [[c, f, e], [c, d, g, f]]

    def pole(self, a, tip):
        """A fan of triangles from a row to one point."""
        tip, = self.row([tip])
        for i in range(len(a) - 1):
            self.faces.append([a[i], a[i + 1], tip])

    def wedge(self, a, points):
        """Closes half a tube: quads to a row of points on the mirror plane, which has two points
        fewer, and a triangle at each end."""
        b = self.row(points)
        self.faces += [[a[0], a[1], b[0]], [a[-1], a[-2], b[-1]]]
        self.bridge(a[1:-1], b)

    def cut(self, rows, columns):
        """Removes the quads of a block given by the points of its corners, rows x columns; returns
        the loop around the hole, its first point repeated at its end."""
        hole = {p for row in rows for p in row[columns[0]:columns[1] + 1]}
        kept = [face for face in self.faces if not hole.issuperset(face)]
        removed = (len(rows) - 1) * (columns[1] - columns[0])
        if len(self.faces) - len(kept) != removed:
            fail("cut() found other faces than the block it was given")
        self.faces = kept
        left, right = columns
        loop = rows[0][left:right + 1] + [row[right] for row in rows[1:-1]]
        loop += rows[-1][left:right + 1][::-1] + [row[left] for row in rows[-2:0:-1]]
        return loop + loop[:1]

    def mirror(self, axis):
        """Adds the other half of a symmetric mesh; points on the plane are shared."""
        twin = {}
        for i, p in enumerate(list(self.points)):
            if p[axis] == 0:
                twin[i] = i
            else:
                q = list(p)
                q[axis] = -q[axis]
                twin[i], = self.row([q])
        self.faces += [[twin[i] for i in face] for face in self.faces]

    def transform(self, function):
        self.points = [function(p) for p in self.points]

    def add(self, other, function):
        """Adds a copy of another model, its points moved by a function."""
        base = len(self.points)
        self.points += [function(p) for p in other.points]
        self.faces += [[base + i for i in face] for face in other.faces]


def fail(message):
    sys.exit(f"make_meshes.py: {message}")


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(x / length for x in a)


def rotation(axis, degrees):
    """A function that turns points around an axis through the origin (0 = x, 1 = y, 2 = z)."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3

    def turn(p):
        q = list(p)
        q[i], q[j] = c * p[i] - s * p[j], s * p[i] + c * p[j]
        return tuple(q)
    return turn


def half_ring(count, centre, tilt, side, top, bottom):
    """Half a ring around a spine in the plane x = 0, from its top to its bottom through x > 0.
    centre: (y, z); tilt: degrees the spine rises, 0 = along +z; side, top, bottom: its radii."""
    c, s = math.cos(math.radians(tilt)), math.sin(math.radians(tilt))
    points = []
    for k in range(count):
        angle = math.pi * k / (count - 1)
        x = 0.0 if k in (0, count - 1) else side * math.sin(angle)
        up = math.cos(angle)
        up *= top if up > 0 else bottom
        points.append((x, centre[0] + up * c, centre[1] - up * s))
    return points


def around(model, loop, centre, u, v):
    """An ellipse around a centre with the half axes u and v: one point for each point of a closed
    loop, evenly spread, in the loop's order and turned to face it."""
    angles = []
    for i in loop[:-1]:
        d = [a - b for a, b in zip(model.points[i], centre)]
        angles.append(math.atan2(dot(d, v) / dot(v, v), dot(d, u) / dot(u, u)))
    count = len(angles)
    turn = sum(math.remainder(b - a, math.tau) for a, b in zip(angles, angles[1:] + angles[:1]))
    step = math.copysign(math.tau / count, turn)
    lag = sum(math.remainder(a - angles[0] - step * i, math.tau) for i, a in enumerate(angles))
    start = angles[0] + lag / count
    points = []
    for i in range(count):
        c, s = math.cos(start + step * i), math.sin(start + step * i)
        points.append(tuple(centre[k] + c * u[k] + s * v[k] for k in range(3)))
    row = model.row(points)
    return row + row[:1]


# ---- finishing and verification ------------------------------------------------------------------

def faces_of_edges(faces):
    """Directed edge -> the faces that run along it."""
    edges = {}
    for f, face in enumerate(faces):
        for a, b in zip(face, face[1:] + face[:1]):
            edges.setdefault((a, b), []).append(f)
    return edges


def volume(points, faces):
    total = 0.0
    for face in faces:
        for b, c in zip(face[1:], face[2:]):
            total += dot(points[face[0]], cross(points[b], points[c])) / 6
    return total


def components(faces):
    """Lists of face numbers; faces of a list are connected through edges."""
    edges = faces_of_edges(faces)
    seen, result = set(), []
    for start in range(len(faces)):
        if start in seen:
            continue
        seen.add(start)
        todo = [start]
        for f in todo:
            for a, b in zip(faces[f], faces[f][1:] + faces[f][:1]):
                for g in edges.get((b, a), []) + edges.get((a, b), []):
                    if g not in seen:
                        seen.add(g)
                        todo.append(g)
        result.append(todo)
    return result


def turn_outward(model):
    """Gives all faces of a component one winding, and each component a positive volume."""
    faces = model.faces
    undirected = {}
    for (a, b), users in faces_of_edges(faces).items():
        undirected.setdefault((min(a, b), max(a, b)), []).extend((f, a < b) for f in users)
    flipped = {}
    for part in components(faces):
        flipped[part[0]] = False
        for f in part:                          # breadth first: f is decided before it is reached
            for a, b in zip(faces[f], faces[f][1:] + faces[f][:1]):
                for g, forward in undirected[min(a, b), max(a, b)]:
                    if g not in flipped:
                        flipped[g] = flipped[f] ^ (forward == (a < b))
        oriented = [faces[f][::-1] if flipped[f] else faces[f] for f in part]
        inward = volume(model.points, oriented) < 0
        for f, face in zip(part, oriented):
            faces[f] = face[::-1] if inward else face


def drop_unused(model):
    used = sorted({i for face in model.faces for i in face})
    new = {old: i for i, old in enumerate(used)}
    model.points = [model.points[i] for i in used]
    model.faces = [[new[i] for i in face] for face in model.faces]


def verify(name, points, faces):
    """Ends the program unless the mesh is what this file's first lines promise."""
    if any(not 3 <= len(face) <= 5 or len(set(face)) != len(face) for face in faces):
        fail(f"{name}: a face has other than 3, 4 or 5 different corners")
    if {i for face in faces for i in face} != set(range(len(points))):
        fail(f"{name}: a point is not used, or a face names one that does not exist")
    edges = faces_of_edges(faces)
    for (a, b), users in edges.items():
        if len(users) != 1:
            fail(f"{name}: {len(users)} faces run from point {a} to {b}")
        if (b, a) not in edges:
            fail(f"{name}: the edge from point {a} to {b} has one face")
    if len({tuple(round(x, 4) for x in p) for p in points}) != len(points):
        fail(f"{name}: two points coincide")
    for vertex, fan in enumerate(fans(points, faces)):
        if len(fan) < 3:
            fail(f"{name}: point {vertex} has {len(fan)} edges")
    for part in components(faces):
        if volume(points, [faces[f] for f in part]) <= 0:
            fail(f"{name}: a component is inside out")
        corners = {i for f in part for i in faces[f]}
        sides = sum(len(faces[f]) for f in part)
        if len(corners) - sides // 2 + len(part) != 2:
            fail(f"{name}: a component is not a deformed sphere")


def fans(points, faces):
    """Per point: the ends of its edges in order. Fails if its faces are not one fan."""
    following = [{} for _ in points]
    for face in faces:
        for a, b, c in zip(face[-1:] + face[:-1], face, face[1:] + face[:1]):
            following[b][c] = a
    result = []
    for vertex, ring in enumerate(following):
        fan = [next(iter(ring))]
        while ring[fan[-1]] != fan[0]:
            fan.append(ring[fan[-1]])
            if len(fan) > len(ring):
                break
        if len(fan) != len(ring):
            fail(f"the faces at point {vertex} are not one fan")
        result.append(fan)
    return result


def classes(points, faces):
    """Number of faces per class of patch, by the rules of the manual in patchsurf.h."""
    fan = fans(points, faces)
    all_triangles = [True] * len(points)
    for face in faces:
        if len(face) != 3:
            for i in face:
                all_triangles[i] = False
    candidate = [all_triangles[i] and all(len(fan[j]) == 4 for j in fan[i])
                 for i in range(len(points))]
    polar = [candidate[i] and not any(candidate[j] for j in fan[i]) for i in range(len(points))]
    count = dict.fromkeys(("ordinary", "polar", "p3", "p4", "p5"), 0)
    for face in faces:
        if len(face) == 4 and all(len(fan[i]) == 4 for i in face):
            count["ordinary"] += 1
        elif len(face) == 3 and any(polar[i] for i in face):
            count["polar"] += 1
        else:
            count[f"p{len(face)}"] += 1
    return count


def finish(folder, name, title, model, expect=()):
    """Verifies a model and writes it. expect: classes of patches it must have."""
    drop_unused(model)
    turn_outward(model)
    points = [tuple(round(x, 5) + 0.0 for x in p) for p in model.points]
    verify(name, points, model.faces)
    count = classes(points, model.faces)
    for kind in expect:
        if not count[kind]:
            fail(f"{name}: no face of class {kind}")
    kinds = ", ".join(f"{number} {kind}" for kind, number in count.items() if number)
    facts = f"{len(points)} vertices, {len(model.faces)} faces: {kinds}"
    with open(os.path.join(folder, name), "w", encoding="ascii", newline="\n") as out:
        out.write(f"# {title}. {facts}\n")
        for p in points:
            out.write("v " + " ".join(f"{x:.5f}".rstrip("0").rstrip(".") for x in p) + "\n")
        for face in model.faces:
            out.write("f " + " ".join(str(i + 1) for i in face) + "\n")
    print(f"{name}: {facts}")


# ---- ten dodecahedra -----------------------------------------------------------------------------

def cyclic(a, b, c):
    return [(a, b, c), (b, c, a), (c, a, b)]


def dodecahedron():
    """With circumradius 1. Its faces look along the corners of an icosahedron; the corners of a
    face are the five that lie furthest that way."""
    golden = (1 + math.sqrt(5)) / 2
    signs = [(a, b) for a in (-1, 1) for b in (-1, 1)]
    corners = [(x, a, b) for x in (-1, 1) for a, b in signs]
    corners += [p for a, b in signs for p in cyclic(0, a / golden, b * golden)]
    model = Model()
    model.row(tuple(x / math.sqrt(3) for x in p) for p in corners)
    for n in (n for a, b in signs for n in cyclic(0, a * golden, b)):
        face = sorted(range(20), key=lambda i: -dot(corners[i], n))[:5]
        u = cross(n, corners[face[0]])
        v = cross(n, u)
        face.sort(key=lambda i: math.atan2(dot(corners[i], v), dot(corners[i], u)))
        model.faces.append(face)
    return model


def dodecahedra():
    """Stacked like cannon balls: one, three and six. The neighbours that a ball can have in such a
    stack lie 13 degrees off the normals of the twelve faces: the dodecahedra nearly touch."""
    distance = 1.66
    solid = dodecahedron()
    model = Model()
    for i in range(3):
        for j in range(3 - i):
            for k in range(3 - i - j):
                c = [distance * t / math.sqrt(2) for t in (j + k, k + i, i + j)]
                model.add(solid, lambda p, c=c: (p[0] - c[0], p[1] - c[1], p[2] - c[2]))
    # The diagonal (1, 1, 1), from the other balls to the first, becomes the y axis.
    model.transform(rotation(1, -45))
    model.transform(rotation(0, -math.degrees(math.atan(math.sqrt(2)))))
    model.transform(rotation(1, 30))
    if len(model.points) != 200 or len(model.faces) != 120:
        fail("ten dodecahedra have 200 vertices and 120 faces")
    return model


# ---- ball ----------------------------------------------------------------------------------------

def ball(meridians=12, bands=6):
    """Lat-long, its axis tilted like the earth's."""
    model = Model()
    previous = None
    for j in range(1, bands):
        y, r = math.cos(math.pi * j / bands), math.sin(math.pi * j / bands)
        ring = model.row((r * math.sin(math.tau * i / meridians), y,
                          r * math.cos(math.tau * i / meridians)) for i in range(meridians))
        ring += ring[:1]
        if previous:
            model.bridge(previous, ring)
        else:
            model.pole(ring, (0, 1, 0))
        previous = ring
    model.pole(previous, (0, -1, 0))
    model.transform(rotation(2, -23.5))
    return model


# ---- creature ------------------------------------------------------------------------------------

def creature():
    """A baby elephant, one half modelled along its spine from tail to trunk, then mirrored."""
    m = Model()
    tail = [m.row(half_ring(4, *ring)) for ring in (
        ((0.86, -1.68), 100, 0.10, 0.10, 0.10),
        ((1.05, -1.62), 95, 0.07, 0.07, 0.07),
        ((1.32, -1.55), 80, 0.06, 0.06, 0.06),
        ((1.52, -1.42), 50, 0.12, 0.12, 0.12))]
    body = [m.row(half_ring(7, *ring)) for ring in (
        ((1.34, -1.18), 20, 0.52, 0.46, 0.50),
        ((1.30, -0.90), 5, 0.78, 0.72, 0.66),
        ((1.30, -0.36), 0, 0.86, 0.84, 0.70),
        ((1.28, 0.05), 0, 0.88, 0.86, 0.72),
        ((1.30, 0.42), 2, 0.84, 0.84, 0.70),
        ((1.36, 0.92), 12, 0.72, 0.74, 0.66),
        ((1.56, 1.16), 22, 0.62, 0.66, 0.58),
        ((1.76, 1.36), 14, 0.74, 0.76, 0.62),
        ((1.80, 1.70), 0, 0.80, 0.80, 0.66),
        ((1.76, 2.04), -14, 0.70, 0.66, 0.56),
        ((1.66, 2.30), -34, 0.46, 0.42, 0.40))]
    trunk = [m.row(half_ring(4, *ring)) for ring in (
        ((1.46, 2.48), -58, 0.27, 0.24, 0.26),
        ((1.14, 2.62), -74, 0.21, 0.20, 0.20),
        ((0.84, 2.72), -62, 0.19, 0.18, 0.18),
        ((0.64, 2.92), -20, 0.17, 0.17, 0.17),
        ((0.68, 3.18), 34, 0.15, 0.15, 0.15),
        ((0.90, 3.34), 66, 0.14, 0.14, 0.14),
        ((1.08, 3.40), 72, 0.17, 0.17, 0.17))]
    for rows in (tail, body, trunk):
        for a, b in zip(rows, rows[1:]):
            m.bridge(a, b)
    m.pole(tail[0], (0, 0.74, -1.66))
    m.bridge_triangles(body[0], tail[-1])
    m.bridge_pentagons(body[-1], trunk[0])
    m.pole(trunk[-1], (0, 1.08, 3.40))

    leg(m, m.cut(body[1:3], (3, 5)), -0.64)
    leg(m, m.cut(body[4:6], (3, 5)), 0.66)
    ear(m, m.cut(body[7:9], (1, 3)))
    eye(m, m.cut(body[8:10], (2, 3)))
    m.cut(body[9:11], (5, 6))
    lip(m, [body[9][6], body[9][5], body[10][5], body[10][6]])
    m.mirror(0)
    return m


def leg(m, loop, z):
    for y, x, radius in ((0.44, 0.57, 0.27), (0.20, 0.56, 0.27), (0.0, 0.56, 0.32)):
        ring = around(m, loop, (x, y, z), (radius, 0, 0), (0, 0, radius))
        m.bridge(loop, ring)
        loop = ring
    m.pole(loop, (0.56, 0.0, z))


def ear(m, loop):
    # The loop runs down the back edge of the root and up its front.
    for x, z, thick, heights in (
            (0.90, 1.36, 0.07, (2.36, 2.00, 1.64)),
            (1.20, 1.18, 0.06, (2.62, 2.02, 1.36)),
            (1.48, 1.00, 0.05, (2.58, 1.96, 1.22)),
            (1.66, 0.92, 0.04, (2.30, 1.90, 1.46))):
        row = [(x, y, z - thick) for y in heights]
        row += [(x, y, z + thick) for y in reversed(heights)]
        ring = m.row(row)
        ring += ring[:1]
        m.bridge(loop, ring)
        loop = ring
    m.faces += [[loop[0], loop[1], loop[4], loop[5]], [loop[1], loop[2], loop[3], loop[4]]]


def lip(m, loop):
    row = m.row(((0, 1.08, 2.00), (0.24, 1.12, 2.02), (0.17, 1.21, 2.15), (0, 1.21, 2.17)))
    m.bridge(loop, row)
    m.wedge(row, [(0, 1.02, 2.12), (0, 1.12, 2.20)])


def eye(m, loop):
    out = unit((0.92, 0.26, 0.29))
    middle = [sum(m.points[i][k] for i in loop[:-1]) / 4 for k in range(3)]
    u = unit(cross((0, 1, 0), out))
    v = cross(out, u)
    for radius, height in ((0.12, -0.04), (0.11, 0.03)):
        centre = tuple(middle[k] + height * out[k] for k in range(3))
        ring = around(m, loop, centre, tuple(radius * x for x in u), tuple(radius * x for x in v))
        m.bridge(loop, ring)
        loop = ring
    m.pole(loop, tuple(middle[k] + 0.08 * out[k] for k in range(3)))


# ---- axe -----------------------------------------------------------------------------------------

def axe():
    """One half modelled, z > 0, then mirrored."""
    m = Model()

    def ring(count, x, y, wide, thin):
        points = []
        for k in range(count):
            angle = math.pi * k / (count - 1)
            z = 0.0 if k in (0, count - 1) else thin * math.sin(angle)
            points.append((x + wide * math.cos(angle), y, z))
        return m.row(points)

    knob = [ring(5, *r) for r in ((0.10, 0.00, 0.26, 0.20), (0.10, 0.10, 0.33, 0.25),
                                  (0.06, 0.34, 0.27, 0.21), (0.02, 0.60, 0.21, 0.17))]
    shaft = [ring(3, *r) for r in ((0.00, 0.92, 0.22, 0.18), (-0.03, 1.40, 0.22, 0.18),
                                   (-0.03, 1.95, 0.22, 0.18), (0.00, 2.50, 0.23, 0.19))]
    eye = [ring(5, *r) for r in ((0.0, 2.84, 0.22, 0.18), (0.0, 3.06, 0.23, 0.19),
                                 (0.0, 3.36, 0.24, 0.20), (0.0, 3.66, 0.24, 0.20),
                                 (0.0, 3.96, 0.24, 0.20), (0.0, 4.16, 0.22, 0.18))]
    for rows in (knob, shaft, eye):
        for a, b in zip(rows, rows[1:]):
            m.bridge(a, b)
    m.pole(knob[0], (0.10, -0.04, 0))
    m.bridge_triangles(knob[-1], shaft[0])
    m.bridge_pentagons(eye[0], shaft[-1])
    m.pole(eye[-1], (0, 4.22, 0))

    blade(m, head_row(m, eye, 0, 1))
    poll(m, head_row(m, eye, 4, 3))
    m.mirror(2)
    m.transform(rotation(2, -14))
    return m


def head_row(m, eye, plane, side):
    """Opens the handle on one side of the plane z = 0; returns the half loop around the hole."""
    m.cut(eye[1:5], (min(plane, side), max(plane, side)))
    return [eye[1][plane]] + [row[side] for row in eye[1:5]] + [eye[4][plane]]


def blade(m, loop):
    for x, curve, low, high, thick in (
            (0.44, 0.00, 3.12, 3.92, 0.19),
            (0.74, 0.03, 3.04, 3.98, 0.14),
            (1.08, 0.08, 2.84, 4.10, 0.09),
            (1.36, 0.16, 2.62, 4.24, 0.04)):
        row = [(x - curve, low, 0.0)]
        for t in (0.06, 0.36, 0.64, 0.94):
            row.append((x - curve * (2 * t - 1) ** 2, low + (high - low) * t, thick))
        row.append((x - curve, high, 0.0))
        row = m.row(row)
        m.bridge(loop, row)
        loop = row
    m.wedge(loop, [(1.30, 2.58, 0), (1.46, 3.20, 0), (1.46, 3.68, 0), (1.30, 4.30, 0)])


def poll(m, loop):
    for x, low, high, thick in ((-0.40, 3.08, 3.94, 0.20), (-0.62, 3.06, 3.96, 0.20)):
        row = [(x, low, 0.0)]
        row += [(x, low + (high - low) * t, thick) for t in (0.08, 0.36, 0.64, 0.92)]
        row = m.row(row + [(x, high, 0.0)])
        m.bridge(loop, row)
        loop = row
    m.wedge(loop, [(-0.64, 3.08 + 0.86 * t, 0) for t in (0.08, 0.36, 0.64, 0.92)])


# --------------------------------------------------------------------------------------------------

def main():
    folder = sys.argv[1] if len(sys.argv) == 2 else os.path.dirname(os.path.abspath(__file__))
    if len(sys.argv) > 2 or not os.path.isdir(folder):
        sys.exit("usage: make_meshes.py [FOLDER]")
    finish(folder, "dodecahedra.obj", "Ten dodecahedra, stacked", dodecahedra(), ["p5"])
    finish(folder, "ball.obj", "Lat-long ball with polar caps", ball(), ["ordinary", "polar"])
    every = ["ordinary", "polar", "p3", "p4", "p5"]
    finish(folder, "creature.obj", "Baby elephant", creature(), every)
    finish(folder, "axe.obj", "Axe", axe(), every)


if __name__ == "__main__":
    main()
