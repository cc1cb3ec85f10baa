#!/usr/bin/env python3
"""Models the sample meshes and writes them as OBJ files beside this program (or into a folder
given as its only argument). Needs Python 3 and nothing else; the same files come out every time.

The faces are counter-clockwise seen from outside, mostly triangles, quads and pentagons. What is
written is verified first, and an offence ends the program: a hole, a face of six corners or more
or a tagged edge that a mesh is not meant to have, for one.
"""
import math
import os
import sys

HARD = 10                                       # sharpness of a hard edge
TENTH = math.log2(2 / 3 / 0.1)                  # of an edge with blend ratio 1/10


# ---- modelling kit -------------------------------------------------------------------------------

class Model:
    """Points and faces. Faces may be entered in either winding: finish() turns them outward, or, on
    open meshes, as the first face of each component."""

    def __init__(self):
        self.points, self.faces = [], []
        self.texture = []                       # for each face its corners' (u, v), or empty
        self.sharpness = {}                     # of tagged edges (a, b), a < b

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

    def crease(self, chain, sharpness):
        """Tags the edges of a chain of points: 10 is a hard edge, less a blend ratio."""
        for a, b in zip(chain, chain[1:]):
            self.sharpness[min(a, b), max(a, b)] = sharpness

    def pole(self, a, tip):
        """A fan of triangles from a row to one point."""
        tip, = self.row([tip])
        for i in range(len(a) - 1):
            self.faces.append([a[i], a[i + 1], tip])

    def wedge(self, a, points):
        """Closes half a tube: quads to a row of points on the mirror plane, which has two points
        fewer, and a triangle at each end. Returns that row."""
        b = self.row(points)
        self.faces += [[a[0], a[1], b[0]], [a[-1], a[-2], b[-1]]]
        self.bridge(a[1:-1], b)
        return b

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
        for (a, b), sharpness in list(self.sharpness.items()):
            self.crease([twin[a], twin[b]], sharpness)

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
    """Gives all faces of a component one winding: its first face's, or, if the component is closed,
    the one with a positive volume."""
    faces, texture = model.faces, model.texture
    edges = faces_of_edges(faces)
    flipped = {}
    for part in components(faces):
        flipped[part[0]] = False
        for f in part:                          # breadth first: f is decided before it is reached
            for a, b in zip(faces[f], faces[f][1:] + faces[f][:1]):
                for g in edges[a, b] + edges.get((b, a), []):
                    if g not in flipped:
                        flipped[g] = flipped[f] ^ (g in edges[a, b])
        sides = [e for f in part for e in zip(faces[f], faces[f][1:] + faces[f][:1])]
        closed = all(len(edges[a, b]) + len(edges.get((b, a), [])) == 2 for a, b in sides)
        oriented = [faces[f][::-1] if flipped[f] else faces[f] for f in part]
        inward = closed and volume(model.points, oriented) < 0
        for f in part:
            if flipped[f] ^ inward:
                faces[f] = faces[f][::-1]
                if texture:
                    texture[f] = texture[f][::-1]


def drop_unused(model):
    used = sorted({i for face in model.faces for i in face})
    new = {old: i for i, old in enumerate(used)}
    model.points = [model.points[i] for i in used]
    model.faces = [[new[i] for i in face] for face in model.faces]
    model.sharpness = {(new[a], new[b]): s for (a, b), s in model.sharpness.items()}


def boundary_loops(edges):
    """Number of holes, from the directed edges; fails where two holes touch."""
    after = {}
    for a, b in edges:
        if (b, a) not in edges:
            if b in after:
                fail(f"two holes touch at point {b}")
            after[b] = a
    loops = 0
    while after:
        start = at = next(iter(after))
        loops += 1
        while (at := after.pop(at)) != start:
            pass
    return loops


def verify(name, model, holes, ngons):
    """Ends the program unless the mesh is a deformed sphere with that many holes, or several closed
    ones, and has that many faces of more than 5 corners."""
    points, faces = model.points, model.faces
    if any(len(face) < 3 or len(set(face)) != len(face) for face in faces):
        fail(f"{name}: a face has fewer than 3 different corners")
    if sum(len(face) > 5 for face in faces) != ngons:
        fail(f"{name}: faces of 6 corners and more: not {ngons}")
    if {i for face in faces for i in face} != set(range(len(points))):
        fail(f"{name}: a point is not used, or a face names one that does not exist")
    edges = faces_of_edges(faces)
    for (a, b), users in edges.items():
        if len(users) != 1:
            fail(f"{name}: {len(users)} faces run from point {a} to {b}")
    for a, b in model.sharpness:
        if (a, b) not in edges or (b, a) not in edges:
            fail(f"{name}: there is a tag from point {a} to {b}, and no edge between two faces")
    if boundary_loops(edges) != holes:
        fail(f"{name}: holes: {boundary_loops(edges)} instead of {holes}")
    if len({tuple(round(x, 4) for x in p) for p in points}) != len(points):
        fail(f"{name}: two points coincide")
    for vertex, (fan, closed) in enumerate(fans(points, faces)):
        if closed and len(fan) < 3:
            fail(f"{name}: point {vertex} has {len(fan)} edges")
    parts = components(faces)
    if holes and len(parts) != 1:
        fail(f"{name}: an open mesh of several components")
    for part in parts:
        if not holes and volume(points, [faces[f] for f in part]) <= 0:
            fail(f"{name}: a component is inside out")
        corners = {i for f in part for i in faces[f]}
        sides = {(min(a, b), max(a, b)) for f in part
                 for a, b in zip(faces[f], faces[f][1:] + faces[f][:1])}
        if len(corners) - len(sides) + len(part) + holes != 2:
            fail(f"{name}: a component is not a deformed sphere")
    if model.texture and [len(t) for t in model.texture] != [len(face) for face in faces]:
        fail(f"{name}: faces and texture do not agree")


def fans(points, faces):
    """Per point: its faces counter-clockwise as pairs (face, the end of the edge where it begins),
    and whether they close. Fails if they are not one fan."""
    begins = [{} for _ in points]               # end of an edge -> the face that begins there
    after = [{} for _ in points]                # -> the end of the edge where that face ends
    for f, face in enumerate(faces):
        for a, b, c in zip(face[-1:] + face[:-1], face, face[1:] + face[:1]):
            begins[b][c], after[b][c] = f, a
    result = []
    for vertex, ring in enumerate(after):
        first = set(ring) - set(ring.values())
        end = start = first.pop() if first else min(ring)
        fan = []
        while end in ring and (not fan or end != start):
            fan.append((begins[vertex][end], end))
            end = ring[end]
        if len(fan) != len(ring):
            fail(f"the faces at point {vertex} are not one fan")
        result.append((fan, end == start))
    return result


def wedges(points, faces, hard):
    """(point, face) -> (faces of the wedge, its effective valence, hard and boundary edges at the
    point), by the rules of the manual in patchsurf.h. A valence of None: the face is alone on its
    side of a crease and has to be split."""
    result = {}
    for vertex, (fan, closed) in enumerate(fans(points, faces)):
        starts = [i for i, (_, end) in enumerate(fan)
                  if (min(vertex, end), max(vertex, end)) in hard or not closed and i == 0]
        sharp = len(starts) + (not closed)
        if sharp > 2:
            fail(f"classes() does not know corners of {sharp} creases, as at point {vertex}")
        if sharp < 2:
            parts = [fan]
        elif closed:
            i, j = starts
            parts = [fan[i:j], fan[j:] + fan[:i]]
        else:
            parts = [fan]
        for part in parts:
            k = len(part)
            valence = k if sharp < 2 else 2 * k if k > 1 else None if closed else 4
            for f, _ in part:
                result[vertex, f] = ([g for g, _ in part], valence, sharp)
    return result


def classes(points, faces, hard):
    """Number of faces per class of patch, by the rules of the manual in patchsurf.h."""
    wedge = wedges(points, faces, hard)
    pieces, whole, points = [], [], list(points)
    for f, face in enumerate(faces):
        if len(face) > 5 or any(wedge[i, f][1] is None for i in face):
            points.append(None)                 # the centre of a fan
            pieces += [[a, b, len(points) - 1] for a, b in zip(face, face[1:] + face[:1])]
        else:
            whole.append(len(pieces))
            pieces.append(face)
    wedge = wedges(points, pieces, hard)

    def candidate(i, f):
        """Whether a point could be a pole, with f one of its faces."""
        fan, _, sharp = wedge[i, f]
        return sharp == 0 and all(len(pieces[g]) == 3 and all(j == i or wedge[j, g][1] == 4
                                                              for j in pieces[g]) for g in fan)

    def pole(i, f):
        return candidate(i, f) and not any(candidate(j, g) for g in wedge[i, f][0]
                                           for j in pieces[g] if j != i)

    count = dict.fromkeys(("ordinary", "polar", "p3", "p4", "p5", "ngon"), 0)
    count["ngon"] = len(faces) - len(whole)
    for f in whole:
        face = pieces[f]
        if len(face) == 4 and all(wedge[i, f][1] == 4 for i in face):
            count["ordinary"] += 1
        elif len(face) == 3 and any(pole(i, f) for i in face):
            count["polar"] += 1
        else:
            count[f"p{len(face)}"] += 1
    return count


def describe(points, model, count):
    """What the first line of a file says of its mesh."""
    kinds = ", ".join(f"{number} {kind}" for kind, number in count.items() if number)
    facts = [f"{len(points)} vertices, {len(model.faces)} faces: {kinds}"]
    edges = faces_of_edges(model.faces)
    boundary = sum((b, a) not in edges for a, b in edges)
    if boundary:
        facts.append(f"{boundary} boundary edges")
    for sharpness in sorted(set(model.sharpness.values())):
        number = list(model.sharpness.values()).count(sharpness)
        blend = f"with blend ratio {2 / 3 * 2 ** -sharpness:.3g}"
        facts.append(f"{number} edges {blend if sharpness < HARD else 'hard'}")
    return "; ".join(facts)


def rounded(numbers):
    return tuple(round(x, 5) + 0.0 for x in numbers)        # no negative zero


def text(numbers):
    return " ".join(f"{x:.5f}".rstrip("0").rstrip(".") for x in numbers)


def finish(folder, name, title, model, expect=(), holes=0, ngons=0):
    """Verifies a model and writes it. expect: classes of patches it must have."""
    drop_unused(model)
    turn_outward(model)
    model.points = [rounded(p) for p in model.points]
    model.texture = [[rounded(p) for p in corners] for corners in model.texture]
    verify(name, model, holes, ngons)
    hard = {edge for edge, sharpness in model.sharpness.items() if sharpness >= HARD}
    count = classes(model.points, model.faces, hard)
    for kind in expect:
        if not count[kind]:
            fail(f"{name}: no face of class {kind}")
    facts = describe(model.points, model, count)
    places = {}
    for p in (p for corners in model.texture for p in corners):
        places.setdefault(p, len(places) + 1)
    with open(os.path.join(folder, name), "w", encoding="ascii", newline="\n") as out:
        out.write(f"# {title}. {facts}\n")
        out.writelines(f"v {text(p)}\n" for p in model.points)
        out.writelines(f"vt {text(p)}\n" for p in places)
        for f, face in enumerate(model.faces):
            corners = [str(i + 1) for i in face]
            if model.texture:
                corners = [f"{c}/{places[p]}" for c, p in zip(corners, model.texture[f])]
            out.write("f " + " ".join(corners) + "\n")
        out.writelines(f"t crease 2/1/0 {a} {b} {text([sharpness])}\n"
                       for (a, b), sharpness in sorted(model.sharpness.items()))
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

def axe(sharpness=0):
    """One half modelled, z > 0, then mirrored. sharpness: of the blade's edge, 0 = no tag."""
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

    blade(m, head_row(m, eye, 0, 1), sharpness)
    poll(m, head_row(m, eye, 4, 3))
    m.mirror(2)
    if sharpness:       # The edge, where surfaces turn within a small distance, near the origin.
        m.transform(lambda p: (p[0] - 1.4, p[1] - 3.4, p[2]))
    m.transform(rotation(2, -14))
    if sharpness:
        m.transform(rotation(1, -28))
    return m


def head_row(m, eye, plane, side):
    """Opens the handle on one side of the plane z = 0; returns the half loop around the hole."""
    m.cut(eye[1:5], (min(plane, side), max(plane, side)))
    return [eye[1][plane]] + [row[side] for row in eye[1:5]] + [eye[4][plane]]


def blade(m, loop, sharpness):
    rows = [(0.44, 0.00, 3.12, 3.92, 0.19), (0.74, 0.03, 3.04, 3.98, 0.14),
            (1.08, 0.08, 2.84, 4.10, 0.09), (1.36, 0.16, 2.62, 4.24, 0.04)]
    edge = [(1.30, 2.58, 0), (1.46, 3.20, 0), (1.46, 3.68, 0), (1.30, 4.30, 0)]
    if sharpness:                               # thick, with a broad bevel
        rows[2:] = [(1.02, 0.08, 2.84, 4.10, 0.13), (1.30, 0.06, 2.54, 4.32, 0.12)]
        edge = [(1.42, 2.44, 0), (1.66, 3.14, 0), (1.66, 3.74, 0), (1.42, 4.42, 0)]
    for x, curve, low, high, thick in rows:
        row = [(x - curve, low, 0.0)]
        for t in (0.06, 0.36, 0.64, 0.94):
            row.append((x - curve * (2 * t - 1) ** 2, low + (high - low) * t, thick))
        row.append((x - curve, high, 0.0))
        row = m.row(row)
        m.bridge(loop, row)
        loop = row
    edge = m.wedge(loop, edge)
    if sharpness:
        m.crease([loop[0], *edge, loop[-1]], sharpness)


def poll(m, loop):
    for x, low, high, thick in ((-0.40, 3.08, 3.94, 0.20), (-0.62, 3.06, 3.96, 0.20)):
        row = [(x, low, 0.0)]
        row += [(x, low + (high - low) * t, thick) for t in (0.08, 0.36, 0.64, 0.92)]
        row = m.row(row + [(x, high, 0.0)])
        m.bridge(loop, row)
        loop = row
    m.wedge(loop, [(-0.64, 3.08 + 0.86 * t, 0) for t in (0.08, 0.36, 0.64, 0.92)])


# ---- hand ----------------------------------------------------------------------------------------

def hand():
    """A left hand seen from its back: fingers towards +y, thumb on the side +x, open at the wrist.
    A ring of the palm runs over the back from the little finger to the index finger, and back."""
    m = Model()
    fingers = (                         # root, splay, length, half width and thickness, curl
        ((-3.25, 8.45), -16, 5.6, 0.94, 0.94, 14),
        ((-1.12, 9.45), -5, 6.9, 1.07, 1.02, 10),
        ((1.15, 9.75), 3, 7.4, 1.10, 1.06, 6),
        ((3.38, 9.20), 12, 6.7, 1.08, 1.04, 2))
    roots = [m.row(finger_ring((*at, 0.0), splay, 0, 1.06 * wide, 1.12 * thick))
             for at, splay, _, wide, thick, _ in fingers]
    base = [i for root in roots for i in root[:3]]
    base += [i for root in reversed(roots) for i in root[3:]]

    rows = [base + base[:1]]
    for row in (                        # heights of little, middle, index side; sides; back, front
            ((7.00, 8.10, 7.75), (-4.40, 4.60), (1.50, -1.35), 2.4),
            ((5.60, 6.40, 6.15), (-4.55, 4.65), (1.50, -1.60), 2.6)):
        rows.append(palm_ring(m, base[:12], base[:12], *row))
    kept = [i for k, i in enumerate(base[:12]) if k not in (2, 5, 9)]
    for row in (
            ((4.20, 4.70, 4.60), (-4.50, 4.55), (1.50, -1.90), 2.6),
            ((2.75, 3.00, 3.00), (-4.20, 4.20), (1.50, -2.10), 2.6),
            ((1.30, 1.40, 1.40), (-3.70, 3.60), (1.50, -2.05), 2.4),
            ((0.00, 0.00, 0.00), (-2.95, 2.90), (1.50, -1.75), 2.2)):
        rows.append(palm_ring(m, kept, kept, *row))
    front = kept[:4] + kept[5:]
    for row in (
            ((-1.40, -1.40, -1.40), (-2.75, 2.75), (1.60, -1.70), 2.0),
            ((-2.90, -2.90, -2.90), (-2.90, 2.90), (1.80, -1.80), 2.0)):
        rows.append(palm_ring(m, kept, front, *row))
    fewer = {2: (2, 5, 9, 14, 18, 21), 6: (13,)}
    for k, (a, b) in enumerate(zip(rows, rows[1:])):
        if k in fewer:
            merge(m, a, b, fewer[k])
        else:
            m.bridge(b, a)

    for left, right in zip(roots, roots[1:]):
        m.faces.append([left[2], right[0], right[5], left[3]])
    for root, (at, splay, length, wide, thick, curl) in zip(roots, fingers):
        finger(m, root + root[:1], (*at, 0.0), splay, curl, length, wide, thick)
    thumb(m, m.cut(rows[3:6], (8, 10)))
    return m


def finger_ring(centre, splay, pitch, wide, thick):
    """Six points: over the back from left to right, then back on the side of the palm. splay turns
    the finger to the side, pitch bends it towards the palm."""
    side = rotation(2, -splay)((1, 0, 0))
    up = rotation(2, -splay)(rotation(0, -pitch)((0, 0, 1)))
    points = []
    for angle in (150, 90, 30, -30, -90, -150):
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        points.append([centre[k] + wide * c * side[k] + thick * s * up[k] for k in range(3)])
    return points


def finger(m, loop, at, splay, pitch, length, wide, thick):
    """Angles in degrees. A ring after every step, in parts of the length; the joints bend there."""
    for step, bend, size in ((0.10, 0, 0.96), (0.17, 0, 0.93), (0.15, 12, 1.00), (0.14, 12, 0.88),
                             (0.16, 8, 0.90), (0.15, 6, 0.80), (0.08, 4, 0.48), (0.02, 0, 0)):
        ahead = rotation(2, -splay)(rotation(0, -pitch)((0, 1, 0)))
        at = [at[k] + step * length * ahead[k] for k in range(3)]
        if size:
            ring = m.row(finger_ring(at, splay, pitch + bend / 2, wide * size, thick * size))
            m.bridge(loop, ring + ring[:1])
            loop = ring + ring[:1]
            pitch += bend
    m.pole(loop, at)


def palm_ring(m, back, front, heights, sides, depths, power):
    """A superellipse with a point below each of a row of points on the back, and of a row on the
    front, which runs the other way. Both rows begin and end with the same points."""
    xs = [m.points[i][0] for i in back], [m.points[i][0] for i in front[::-1]]
    low, high = xs[0][0], xs[0][-1]
    points = []
    for row, depth in zip(xs, depths):
        for x in row:
            t = 0.97 * (2 * (x - low) / (high - low) - 1)
            y = heights[1] + (heights[2 if t > 0 else 0] - heights[1]) * t * t
            x = (sides[0] + sides[1]) / 2 + t * (sides[1] - sides[0]) / 2
            points.append((x, y, depth * (1 - abs(t) ** power) ** (1 / power)))
    row = m.row(points)
    return row + row[:1]


def merge(m, fine, coarse, dropped):
    """Quads between two rows, and a pentagon at every point of the fine row that the coarse row
    does not have."""
    kept = [k for k in range(len(fine)) if k not in dropped]
    for i, (k, j) in enumerate(zip(kept, kept[1:])):
        m.faces.append([*fine[k:j + 1], coarse[i + 1], coarse[i]])


def thumb(m, loop):
    centres = ((4.35, 3.70, -1.10), (5.15, 4.70, -1.35), (5.90, 5.80, -1.50), (6.45, 6.80, -1.55),
               (6.90, 7.80, -1.50), (7.20, 8.65, -1.40), (7.34, 9.15, -1.33), (7.38, 9.30, -1.30))
    sizes = ((1.60, 1.30), (1.30, 1.15), (1.12, 1.00), (1.05, 0.92), (1.05, 0.88), (0.85, 0.72),
             (0.48, 0.42))
    before = (3.6, 2.9, -0.8)
    for centre, after, (wide, thick) in zip(centres, centres[1:], sizes):
        ahead = [b - a for a, b in zip(before, after)]
        u = unit(cross(ahead, (0.5, 0, 1)))
        v = unit(cross(u, ahead))
        ring = around(m, loop, centre, [wide * x for x in u], [thick * x for x in v])
        m.bridge(loop, ring)
        loop, before = ring, centre
    m.pole(loop, centres[-1])


# ---- rounded cube --------------------------------------------------------------------------------

def rounded_cube(flat=0.74):
    """Four triangles round the middle of each side, two on each edge, one at each corner. The
    diagonals of the edges turn the same way everywhere: all corners have six edges."""
    m = Model()
    number = {}
    signs = [(a, b) for a in (-1, 1) for b in (-1, 1)]

    def corner(axis, a, b, c):
        """A point with a along the axis, b and c along the next ones."""
        p = cyclic(a, b, c)[-axis]
        if p not in number:
            number[p], = m.row([p])
        return number[p]

    for axis in range(3):
        for side in (-1, 1):
            ring = [corner(axis, side, flat * a, flat * b)
                    for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1), (1, 1))]
            m.pole(ring, cyclic(side, 0, 0)[-axis])
        for a, b in signs:
            turn = a * b * flat
            p, q = corner(axis, turn, a, b * flat), corner(axis, -turn, a, b * flat)
            r, s = corner(axis, -turn, a * flat, b), corner(axis, turn, a * flat, b)
            m.faces += [[p, q, r], [p, r, s]]
    for a in (-1, 1):
        for b, c in signs:
            m.faces.append([corner(0, a, b * flat, c * flat), corner(1, b, c * flat, a * flat),
                            corner(2, c, a * flat, b * flat)])
    edges = sum(len(face) for face in m.faces) // 2
    if (len(m.points), edges, len(m.faces)) != (30, 84, 56):
        fail("the rounded cube has 30 vertices, 84 edges and 56 faces")
    return m


# ---- pawn ----------------------------------------------------------------------------------------

def pawn(count=12):
    """Turned on a lathe from its foot, which is one face, to its head, which ends in a pole."""
    m = Model()
    profile = (                         # radius, height, sharpness of the ring
        (1.00, 0.00, HARD), (1.06, 0.12, 0), (1.06, 0.26, 0), (1.00, 0.38, HARD),
        (0.86, 0.40, HARD), (0.86, 0.52, 0), (0.74, 0.66, 0), (0.58, 0.78, 0), (0.44, 0.98, 0),
        (0.36, 1.26, 0), (0.31, 1.56, 0), (0.30, 1.78, HARD), (0.50, 1.84, TENTH),
        (0.50, 1.94, TENTH), (0.30, 2.00, HARD), (0.48, 2.16, 0), (0.55, 2.42, 0),
        (0.46, 2.70, 0), (0.24, 2.86, 0))
    rings = []
    for radius, y, sharpness in profile:
        ring = m.row((radius * math.sin(math.tau * i / count), y,
                      radius * math.cos(math.tau * i / count)) for i in range(count))
        rings.append(ring + ring[:1])
        if sharpness:
            m.crease(rings[-1], sharpness)
    for a, b in zip(rings, rings[1:]):
        m.bridge(a, b)
    m.faces.append(rings[0][:-1])
    m.pole(rings[-1], (0, 2.90, 0))
    return m


# ---- plate ---------------------------------------------------------------------------------------

def plate():
    """A cover plate with a round opening: big quads outside, quads of half the size round the
    opening. A big quad beside two small ones is a pentagon with a corner in the middle of a side.
    """
    m = Model()
    number = {}

    def corner(x, y):                           # on a grid of the small quads
        if (x, y) not in number:
            number[x, y], = m.row([collar(x, y)])
        return number[x, y]

    for x in range(-4, 4):
        for y in range(-4, 4):
            if not (-2 <= x < 2 and -2 <= y < 2):
                loop = ((x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1))
                m.faces.append([corner(*p) for p in loop])
    for x in range(-8, 8, 2):
        for y in range(-6, 6, 2):
            if not (-4 <= x < 4 and -4 <= y < 4):
                loop = ((x, y), (x + 1, y), (x + 2, y), (x + 2, y + 1), (x + 2, y + 2),
                        (x + 1, y + 2), (x, y + 2), (x, y + 1))
                # The middle of a side counts where it is a corner of small quads.
                m.faces.append([corner(*p) for i, p in enumerate(loop) if not i % 2 or p in number])
    m.transform(rotation(0, -58))
    return m


def collar(x, y):
    """Squares round the opening become circles, and rise to a collar. Outside they stay squares:
    there the points in the middle of sides must remain in the middle."""
    level = max(abs(x), abs(y))
    if level > 3:
        return (x, y, 0.0)
    angle = math.atan2(y, x)
    # Evenly spread over the circle: 8 steps a quarter of the way round, seen from the square.
    side = round(angle / (math.pi / 2)) * math.pi / 2
    across = math.remainder(angle - side, math.tau)
    along = math.tan(across) * math.pi / 4
    radius, height = {2: (1.80, 1.8), 3: (2.45, 0.10)}[level]
    return (radius * math.cos(side + along), radius * math.sin(side + along), height)


# ---- cloth ---------------------------------------------------------------------------------------

def cloth(half=8, pieces=4):
    """A square grid over a round table. Its middle is one piece of fabric, each side another, cut
    on the bias: texture coordinates do not match where they are sewn together."""
    m = Model()
    span = range(-half, half + 1)
    row = [m.row(drape(x / half, y / half) for x in span) for y in span]
    for j in range(2 * half):
        for i in range(2 * half):
            m.faces.append([row[j][i], row[j][i + 1], row[j + 1][i + 1], row[j + 1][i]])
            corners = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))
            m.texture.append(fabric(i + 0.5 - half, j + 0.5 - half,
                                    [((x - half) / half, (y - half) / half) for x, y in corners]))
    return m


def drape(x, y, table=0.5, folds=8):
    """Where a point of the flat cloth, sides at +-1, comes to lie. Squares in the middle become
    circles, so that a row of the grid lies on the rim of the table."""
    level = max(abs(x), abs(y))
    if level == 0:
        return (0.0, 0.0, 0.0)
    round_off = level / math.hypot(x, y)
    square = max(0.0, level - table) / (1 - table)
    length = math.hypot(x, y) * (round_off + (1 - round_off) * square)
    angle = math.atan2(y, x)
    hang = max(0.0, length - table)
    radius = min(length, table) + 0.10 * hang
    radius += 0.16 * hang * math.cos(folds * angle)
    return (radius * math.cos(angle), -0.98 * hang, -radius * math.sin(angle))


def fabric(i, j, corners):
    """Texture coordinates of a face, its piece chosen by its middle: upright in the middle of the
    cloth, and turned on its sides, each with an offset of its own."""
    if max(abs(i), abs(j)) < 4:
        return [(0.5 + x / 2, 0.5 + y / 2) for x, y in corners]
    side = 1 + (j > 0) if abs(j) > 4 else 3 + (i > 0)
    turn = rotation(2, 45 if side < 3 else 20)
    places = (turn((x, y, 0)) for x, y in corners)
    return [(0.5 + 0.34 * x + 0.031 * side, 0.5 + 0.34 * y) for x, y, _ in places]


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
    finish(folder, "axe_blend.obj", "Axe, its blade's edge sharp", axe(TENTH), every)
    finish(folder, "axe_hard.obj", "Axe, its blade's edge hard", axe(HARD), every)
    finish(folder, "hand.obj", "Hand with polar fingertips, open at the wrist", hand(),
           ["ordinary", "polar", "p4", "p5"], holes=1)
    finish(folder, "rounded_cube.obj", "Rounded cube, 84 edges", rounded_cube(), ["p3"])
    finish(folder, "pawn.obj", "Turned pawn", pawn(), ["ordinary", "polar", "ngon"], ngons=1)
    finish(folder, "plate.obj", "Plate with T-corners and a round opening", plate(),
           ["ordinary", "p4", "p5"], holes=2)
    finish(folder, "cloth.obj", "Cloth over a round table, sewn from five pieces", cloth(),
           ["ordinary"], holes=1)


if __name__ == "__main__":
    main()
