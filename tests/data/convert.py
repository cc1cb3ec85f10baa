#!/usr/bin/env python3
"""Turns a golden JSON file into the text that test_golden.c (pm_*.json) or test_schemes.c (the
point-normal schemes, all others) reads.

usage: convert.py in.json > out.txt

Of pm, samples of the JSON are parameters of the patch; those of the text are of the face, as
psurf_sample defines them: weights of corners 1 and 2 of a triangle, the unit square of a quad,
(sector, weight of corner sector, weight of corner sector + 1) from five corners on. Numbers keep
all 17 significant digits. Sections, each with its count of rows:

  mesh V F           V positions, F faces (size, vertices)
  alpha A            blend ratio of every edge end that blends does not name
  blends N           vertex, other end, blend ratio at vertex
  hard N             hard edges: two vertices
  corners N          vertices with the corner flag
  rings N            vertex, closed, spokes, facets, limit point; per spoke its end and t;
                     per facet its f
  patches N          face, piece of a split face, kind, points; the points
  samples N          face, sector, u, v, position, normal

Of the point-normal schemes a file has cases, each with samples of whole faces:

  cases N
  case NAME
  mesh V F           as above
  normals N          N unit normals
  face_normals N     0: a corner has its vertex's normal; else, per face, the normals of its corners
  samples N          face, u, v, position, normal; 1 and the shading normal, or 0; 1 and the
                     Gaussian curvature, or 0
"""
import json
import sys

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def text(values):
    return " ".join(repr(float(v)) for v in values)


def write_mesh(vertices, faces):
    print("mesh", len(vertices), len(faces))
    for vertex in vertices:
        print(text(vertex))
    for face in faces:
        print(len(face), *face)


def weights_in_patch(kind, size, start, sample):
    """Weights of the patch's corners, the centre's spread evenly; for a square: its u, v."""
    u, v = sample["u"], sample["v"]
    weights = [0.0] * size
    if kind == "polar":
        weights[start] = (1 - u) * (1 - v)
        weights[(start + 1) % size] = u * (1 - v)
        weights[(start + 2) % size] = v
        return weights
    sector = sample["sector"]
    weights = [v / size] * size
    weights[sector] += 1 - u - v
    weights[(sector + 1) % size] += u
    return weights


def whole_face(kind, size, start, sample):
    """Face parameters of a sample on a face that is not split."""
    u, v = sample["u"], sample["v"]
    if kind == "ordinary":
        return 0, u, v
    if size >= 5:
        return sample["sector"], 1 - u - v, u
    if size == 3:
        weights = weights_in_patch(kind, size, start, sample)
        return 0, weights[1], weights[2]
    sector = sample["sector"]                    # P4: corners and centre of the unit square
    a, b = SQUARE[sector], SQUARE[(sector + 1) % 4]
    return (0,) + tuple((1 - u - v) * a[k] + u * b[k] + v * 0.5 for k in (0, 1))


def split_face(face, piece, corners, kind, start, sample):
    """Face parameters of a sample on a piece of a centroid fan: corner, corner + 1, centroid."""
    size = len(face)
    weights = weights_in_patch(kind, 3, start, sample)
    a = weights[corners.index(face[piece])]
    b = weights[corners.index(face[(piece + 1) % size])]
    if size >= 5:
        return piece, a, b
    share = (1 - a - b) / size
    whole = [share] * size
    whole[piece] += a
    whole[(piece + 1) % size] += b
    if size == 3:
        return 0, whole[1], whole[2]
    return (0,) + tuple(sum(w * c[k] for w, c in zip(whole, SQUARE)) for k in (0, 1))


class Golden:
    def __init__(self, data):
        self.data = data
        self.faces = data["faces"]
        self.split_faces = data.get("split_faces", self.faces)
        self.parents = data.get("split_parent", list(range(len(self.faces))))
        self.patches = {self.facet(p): p for p in data["patches"]}

    @staticmethod
    def facet(row):
        return row.get("split_face", row["face"])

    def piece(self, facet):
        """Which piece of its face a facet is; 0 of a whole face."""
        face, corners = self.faces[self.parents[facet]], self.split_faces[facet]
        if face == corners:
            return None
        size = len(face)
        return next(i for i in range(size)
                    if face[i] in corners and face[(i + 1) % size] in corners
                    and (corners.index(face[i]) + 1) % 3 == corners.index(face[(i + 1) % size]))

    def place(self, sample):
        facet = self.facet(sample)
        patch = self.patches[facet]
        corners = self.split_faces[facet]
        kind, start, piece = patch["kind"], patch.get("start", 0), self.piece(facet)
        if piece is None:
            return whole_face(kind, len(corners), start, sample)
        return split_face(self.faces[sample["face"]], piece, corners, kind, start, sample)

    def rings(self):
        """One row per ring, or per wedge where hard edges cut one."""
        for vertex, ring in enumerate(self.data["vertex_data"]):
            for wedge in ring.get("wedges", [ring]):
                closed = len(wedge["spokes"]) == len(wedge["f"])
                yield vertex, closed, ring["v"], wedge

    def write(self):
        data = self.data
        print("golden", data["name"])
        write_mesh(data["vertices"], self.faces)
        print("alpha", repr(data["default_alpha"]))
        for title, key in (("blends", "alpha"), ("hard", "hard_edges")):
            print(title, len(data.get(key, [])))
            for row in data.get(key, []):
                print(*row)
        print("corners", len(data.get("sharp_boundary_corners", [])),
              *data.get("sharp_boundary_corners", []))
        rings = list(self.rings())
        print("rings", len(rings))
        for vertex, closed, limit, wedge in rings:
            print(vertex, int(closed), len(wedge["spokes"]), len(wedge["f"]), text(limit))
            for end, t in zip(wedge["spokes"], wedge["t"]):
                print(end, text(t))
            for f in wedge["f"]:
                print(text(f))
        print("patches", len(data["patches"]))
        for patch in data["patches"]:
            points = patch["control_points"]
            print(patch["face"], self.piece(self.facet(patch)) or 0, patch["kind"].lower(),
                  len(points))
            for point in points:
                print(text(point))
        print("samples", len(data["samples"]))
        for sample in data["samples"]:
            sector, u, v = self.place(sample)
            print(sample["face"], sector, text((u, v)), text(sample["p"]), text(sample["n"]))


def write_cases(data):
    print("schemes", data["scheme"])
    print("cases", len(data["cases"]))
    for case in data["cases"]:
        print("case", case["name"])
        write_mesh(case["V"], case["F"])
        print("normals", len(case["N"]))
        for normal in case["N"]:
            print(text(normal))
        print("face_normals", len(case.get("FN", [])))
        for row in case.get("FN", []):
            print(*row)
        print("samples", len(case["samples"]))
        for sample in case["samples"]:
            place = sample["st"] if "st" in sample else sample["b"][1:]
            parts = [text(place), text(sample["p"]), text(sample["n"])]
            parts += ["1 " + text(sample["shading_n"]) if "shading_n" in sample else "0"]
            parts += ["1 " + text([sample["K"]]) if "K" in sample else "0"]
            print(sample["f"], *parts)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    with open(sys.argv[1], encoding="utf-8") as source:
        golden = json.load(source)
    if "cases" in golden:
        write_cases(golden)
    else:
        Golden(golden).write()
