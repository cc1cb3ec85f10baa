#!/usr/bin/env python3
"""Counts what a mesh is made of, and compares with `patchsurf info --json`.

    count_mesh.py [--tool build/patchsurf] MESH.obj...

Without --tool it prints its own counts. It works from the definitions alone, with sets and
dictionaries, and shares no code with the library:

    fan         the faces at a vertex that are connected through edges; a vertex can have several
    wedge       the part of a fan between two hard edges
    sharp       hard, or with one face. With h sharp edges in a fan, it is smooth or a dart (h < 2),
                a corner (h > 2, tagged, or a fan of one face), else a crease or a smooth boundary
    n_eff       smooth: the fan's faces; crease: twice, corner: four times the wedge's faces k; but
                twice for the wide wedge of an untagged corner: by nominal angles, triangle 60,
                quad 90, pentagon 108 degrees, at least 180 and half of the fan, and no other is
    ngon        a face with six corners or more, at a closed fan of two faces, or alone in a wedge
                of a crease: it is split into triangles round its centre before the others are
                classified
    ordinary    a quad, all of whose corners have n_eff 4
    polar       a triangle at a polar vertex: all faces there are triangles of one smooth closed fan
                without hard edges, all neighbours have n_eff 4, and none of them is such a vertex
    p3 p4 p5    the others
"""

import argparse
import json
import subprocess
import sys

KEYS = ("vertices faces edges boundary_edges hard_edges components max_valence "
        "ordinary polar p3 p4 p5 ngon valence2").split()


def read_obj(path):
    """Number of vertices, faces as lists of vertex numbers from 0, hard edges, tagged corners."""
    vertices, faces, sharpness = 0, [], {}
    with open(path, encoding="latin-1", newline=None) as file:
        lines = file.read().replace("\\\n", " ").split("\n")
    for line in lines:
        words = line.split()
        if words[:1] == ["v"]:
            vertices += 1
        elif words[:1] == ["f"]:
            refs = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([ref - 1 if ref > 0 else vertices + ref for ref in refs])
        elif words[:2] in (["t", "crease"], ["t", "corner"]):
            ends = 2 if words[1] == "crease" else 1
            integers, floats = map(int, words[2].split("/")[:2])
            numbers, values = words[3:3 + integers], words[3 + integers:3 + integers + floats]
            for i in range(0, integers, ends):
                item = frozenset(map(int, numbers[i:i + ends]))
                sharpness[item] = float(values[i // ends if floats > 1 else 0])
    sharp = {item for item, value in sharpness.items() if value >= 10}
    return (vertices, faces, {item for item in sharp if len(item) == 2},
            {vertex for item in sharp if len(item) == 1 for vertex in item})


class Rings:
    """The fans round the vertices of a list of faces."""

    def __init__(self, faces, hard, tagged, origin=None, one_face=()):
        """origin: the number of each face before faces were split. one_face: the pairs of a vertex
        and such a number where the fan had one face, and so was a corner, before."""
        self.faces, self.tagged = faces, tagged
        self.origin, self.one_face = origin, one_face
        self.edge_faces = {}
        self.at_vertex = {}
        for number, face in enumerate(faces):
            for corner, vertex in enumerate(face):
                ends = frozenset((vertex, face[(corner + 1) % len(face)]))
                self.edge_faces.setdefault(ends, []).append(number)
                self.at_vertex.setdefault(vertex, []).append(number)
        self.hard = {ends for ends in hard if len(self.edge_faces[ends]) == 2}
        self.fans = {vertex: self.split_fans(vertex, ()) for vertex in self.at_vertex}
        self.wedges = {vertex: self.split_fans(vertex, self.hard) if self.hard else fans
                       for vertex, fans in self.fans.items()}

    def split_fans(self, vertex, barriers):
        """The faces at a vertex as sets, connected through the edges at the vertex."""
        left, fans = set(self.at_vertex[vertex]), []
        while left:
            fan, reach = set(), [left.pop()]
            while reach:
                face = reach.pop()
                fan.add(face)
                for other in self.across(vertex, face, barriers):
                    if other in left:
                        left.discard(other)
                        reach.append(other)
            fans.append(fan)
        return fans

    def across(self, vertex, face, barriers):
        for end in self.neighbours(vertex, face):
            ends = frozenset((vertex, end))
            if ends not in barriers:
                for other in self.edge_faces[ends]:
                    if other != face:
                        yield other

    def neighbours(self, vertex, face):
        """The vertices before and after a vertex in a face."""
        corners = self.faces[face]
        at = corners.index(vertex)
        return corners[at - 1], corners[(at + 1) % len(corners)]

    def fan(self, vertex, face):
        return next(fan for fan in self.fans[vertex] if face in fan)

    def closed(self, vertex, fan):
        return all(len(self.edge_faces[frozenset((vertex, end))]) == 2
                   for face in fan for end in self.neighbours(vertex, face))

    def wedge(self, vertex, face):
        return next(wedge for wedge in self.wedges[vertex] if face in wedge)

    def sharp(self, vertex, fan):
        """How many sharp edges a fan has at its vertex."""
        spokes = {frozenset((vertex, end)) for face in fan for end in self.neighbours(vertex, face)}
        return sum(ends in self.hard or len(self.edge_faces[ends]) == 1 for ends in spokes)

    def is_crease(self, vertex, face):
        fan = self.fan(vertex, face)
        return (self.sharp(vertex, fan) == 2 and vertex not in self.tagged
                and (vertex, self.origin[face]) not in self.one_face)

    def is_wide(self, vertex, wedge, fan):
        angle = lambda faces: sum({3: 60, 4: 90, 5: 108}[len(self.faces[face])] for face in faces)
        wide = [other for other in self.wedges[vertex] if other <= fan and angle(other) >= 180
                and 2 * angle(other) >= angle(fan)]
        return wide == [wedge] and vertex not in self.tagged and self.sharp(vertex, fan) > 2

    def n_eff(self, vertex, face):
        fan, wedge = self.fan(vertex, face), self.wedge(vertex, face)
        if self.sharp(vertex, fan) < 2:
            return len(fan)
        narrow = not self.is_crease(vertex, face) and not self.is_wide(vertex, wedge, fan)
        return (4 if narrow else 2) * len(wedge)

    def valence(self, vertex):
        return len({end for face in self.at_vertex[vertex]
                    for end in self.neighbours(vertex, face)})

    def pole_candidate(self, vertex, face):
        fan = self.fan(vertex, face)
        return (self.sharp(vertex, fan) == 0
                and all(len(self.faces[other]) == 3 for other in fan)
                and all(self.n_eff(end, other) == 4
                        for other in fan for end in self.neighbours(vertex, other)))

    def polar_vertex(self, vertex, face):
        return (self.pole_candidate(vertex, face)
                and not any(self.pole_candidate(end, other) for other in self.fan(vertex, face)
                            for end in self.neighbours(vertex, other)))


def classify(rings, face):
    corners = rings.faces[face]
    if len(corners) == 4 and all(rings.n_eff(vertex, face) == 4 for vertex in corners):
        return "ordinary"
    if len(corners) == 3 and any(rings.polar_vertex(vertex, face) for vertex in corners):
        return "polar"
    return "p%d" % len(corners)


def count_components(faces):
    """Sets of faces connected through vertices."""
    root = {}

    def find(item):
        while root.setdefault(item, item) != item:
            root[item] = root[root[item]]
            item = root[item]
        return item

    for face in faces:
        for vertex in face[1:]:
            root[find(vertex)] = find(face[0])
    return len({find(face[0]) for face in faces})


def split_faces(first_centre, faces, origin, ngons):
    """The faces with those of ngons as triangles, and which face each was before."""
    split, before = [], []
    for number, corners in enumerate(faces):
        centre = first_centre + number
        pieces = ([[corners[i - 1], corners[i], centre] for i in range(len(corners))]
                  if number in ngons else [corners])
        split += pieces
        before += [origin[number]] * len(pieces)
    return split, before


def count(vertices, faces, hard, tagged):
    rings = Rings(faces, hard, tagged)
    one_face = {(vertex, face) for vertex, fans in rings.fans.items() for fan in fans
                if len(fan) == 1 for face in fan}
    valence2 = {(vertex, face) for vertex, fans in rings.fans.items() for fan in fans
                if len(fan) == 2 and rings.closed(vertex, fan) for face in fan}
    ngons = {face for face, corners in enumerate(faces) if len(corners) >= 6}
    ngons |= {face for vertex, face in valence2}

    pieces, origin = split_faces(vertices, faces, range(len(faces)), ngons)
    split = Rings(pieces, hard, tagged, origin, one_face)
    alone = {number for number, face in enumerate(pieces) for vertex in face
             if split.is_crease(vertex, number) and len(split.wedge(vertex, number)) == 1}
    ngons |= {origin[number] for number in alone}
    if alone:
        pieces, origin = split_faces(vertices + len(faces), pieces, origin, alone)
        split = Rings(pieces, hard, tagged, origin, one_face)

    result = dict.fromkeys(KEYS, 0)
    result["vertices"] = vertices
    result["faces"] = len(faces)
    result["edges"] = len(rings.edge_faces)
    result["boundary_edges"] = sum(len(uses) == 1 for uses in rings.edge_faces.values())
    result["hard_edges"] = len(rings.hard)
    result["components"] = count_components(faces)
    result["max_valence"] = max(map(rings.valence, rings.at_vertex))
    result["ngon"] = len(ngons)
    result["valence2"] = len(valence2) // 2
    for number, face in enumerate(origin):
        if face not in ngons:
            result[classify(split, number)] += 1
    return result


def compare(path, counts, tool):
    """True if the tool's counts are the same."""
    run = subprocess.run([tool, "info", path, "--json"], stdout=subprocess.PIPE)
    if run.returncode != 0:
        print("%s: patchsurf info: exit status %d" % (path, run.returncode))
        return False
    theirs = json.loads(run.stdout.decode("ascii"))
    wrong = [key for key in KEYS if theirs.get(key) != counts[key]]
    for key in wrong:
        print("%s: %s: patchsurf info says %s, counted %d" %
              (path, key, theirs.get(key), counts[key]))
    if not wrong:
        print("%s: %d counts agree" % (path, len(KEYS)))
    return not wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--tool", help="the patchsurf tool to compare with")
    parser.add_argument("meshes", nargs="+", metavar="MESH.obj")
    options = parser.parse_args()
    good = True
    for path in options.meshes:
        counts = count(*read_obj(path))
        print("%s: %s" % (path, " ".join("%s %d" % (key, counts[key]) for key in KEYS)))
        if options.tool:
            good = compare(path, counts, options.tool) and good
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
