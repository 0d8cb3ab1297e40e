"""A second opinion on a mesh and its metric in numpy, from the definitions and from nothing of Lamina's code.

Definitions, for an edge e of a mesh whose vertices carry metrics M:
  length in one metric     l = sqrt(e.M e)
  length of an edge        (la - lb) / ln(la / lb) with the lengths in the metrics of its ends; l where they agree
  unit edge                length in [1/sqrt 2, sqrt 2]
and for a cell, in the ONE metric of its vertex with the largest determinant (the first of equals):
  mean ratio               tetrahedra 12 (3 V)^(2/3) / sum l^2, triangles 4 sqrt(3) A / sum l^2, V and A signed and
                           measured in that metric; 1 for the regular simplex, negative for an inverted one
  complexity               sum over cells of V times the mean over the vertices of sqrt(det M)
  aspect ratio             longest edge / smallest height, in world coordinates
"""
import struct
from itertools import combinations
from pathlib import Path

import numpy as np

SQRT2 = np.sqrt(2.0)
# Places of xx, xy, yy, xz, yz, zz (the order of GMF) in a matrix; the first three serve the plane.
TENSOR_PLACES = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))


def full_tensors(values):
    """(n, 3) or (n, 6) entries to (n, d, d) matrices."""
    values = np.asarray(values, float)
    dim = {3: 2, 6: 3}[values.shape[1]]
    out = np.empty((len(values), dim, dim))
    for column, (i, j) in enumerate(TENSOR_PLACES[: values.shape[1]]):
        out[:, i, j] = out[:, j, i] = values[:, column]
    return out


def edges_of(cells):
    """Each edge of the mesh once, as sorted pairs of vertices."""
    pairs = np.vstack([cells[:, list(pair)] for pair in combinations(range(cells.shape[1]), 2)])
    return np.unique(np.sort(pairs, axis=1), axis=0)


def edge_lengths(points, edges, tensors):
    e = points[edges[:, 1]] - points[edges[:, 0]]
    la, lb = (np.sqrt(np.einsum("ni,nij,nj->n", e, tensors[edges[:, k]], e)) for k in (0, 1))
    ratio = np.log(la / lb)
    near = np.abs(ratio) < 1e-4
    # Where the logarithm loses digits the series (la + lb)/2 (1 - ratio^2/12) has an error of ratio^4.
    safe = np.where(near, 1.0, ratio)
    return np.where(near, 0.5 * (la + lb) * (1 - ratio**2 / 12), (la - lb) / safe)


def volumes(points, cells):
    """Signed: positive for a right-handed (counter-clockwise) cell."""
    dim = points.shape[1]
    frame = points[cells[:, 1:]] - points[cells[:, :1]]
    return np.linalg.det(frame) / (6.0 if dim == 3 else 2.0)


def qualities(points, cells, tensors):
    dim = points.shape[1]
    det = np.linalg.det(tensors)
    chosen = cells[np.arange(len(cells)), np.argmax(det[cells], axis=1)]
    M, scale = tensors[chosen], np.sqrt(det[chosen])
    total = np.zeros(len(cells))
    for i, j in combinations(range(dim + 1), 2):
        e = points[cells[:, j]] - points[cells[:, i]]
        total += np.einsum("ni,nij,nj->n", e, M, e)
    volume = volumes(points, cells) * scale
    if dim == 2:
        return 4 * np.sqrt(3.0) * volume / total
    return 12 * np.sign(volume) * np.abs(3 * volume) ** (2 / 3) / total


def aspects(points, cells):
    """Longest edge over smallest height."""
    dim = points.shape[1]
    longest = np.zeros(len(cells))
    for i, j in combinations(range(dim + 1), 2):
        longest = np.maximum(longest, np.linalg.norm(points[cells[:, j]] - points[cells[:, i]], axis=1))
    largest = np.zeros(len(cells))
    for facet in combinations(range(dim + 1), dim):
        x = points[cells[:, list(facet)]]
        if dim == 3:
            size = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
        else:
            size = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
        largest = np.maximum(largest, size)
    return longest * largest / (dim * np.abs(volumes(points, cells)))


def score(points, cells, tensors):
    """Everything `lamina score --json` says that has one definition."""
    edges = edges_of(cells)
    length = edge_lengths(points, edges, tensors)
    quality = qualities(points, cells, tensors)
    volume = volumes(points, cells)
    density = np.sqrt(np.linalg.det(tensors))
    return {
        "points": len(points),
        "cells": len(cells),
        "edges": len(edges),
        "volume": volume.sum(),
        "complexity": (volume * density[cells].mean(axis=1)).sum(),
        "unit_share": np.mean((length >= 1 / SQRT2) & (length <= SQRT2)),
        "length_min": length.min(),
        "length_max": length.max(),
        "length_mean": length.mean(),
        "short_share": np.mean(length < 0.5),
        "long_share": np.mean(length > 2.0),
        "quality_min": quality.min(),
        "quality_mean": quality.mean(),
        "aspect_max": aspects(points, cells).max(),
        "worst_cell": int(np.argmin(quality)),
    }


def boundary_facets(cells):
    """Facets with exactly one cell; raises where one has more than two."""
    size = cells.shape[1] - 1
    facets = np.vstack([np.delete(cells, k, axis=1) for k in range(size + 1)])
    facets, count = np.unique(np.sort(facets, axis=1), axis=0, return_counts=True)
    if count.max() > 2:
        raise ValueError(f"a facet with {count.max()} cells")
    return facets[count == 1]


def read_sol(path):
    """Tensors of a GMF .sol or .solb file, as (n, d, d)."""
    path = Path(path)
    dim, values = (_sol_binary if path.suffix == ".solb" else _sol_text)(path.read_bytes())
    if values.shape[1] == 1:
        values = values**-2.0 * np.array([[1.0, 0, 1, 0, 0, 1][: dim * (dim + 1) // 2]])
    return full_tensors(values)


def _sizes(dim, kinds):
    return sum({1: 1, 2: dim, 3: dim * (dim + 1) // 2}[kind] for kind in kinds)


def _sol_text(data):
    words = data.decode().split()
    dim = int(words[words.index("Dimension") + 1])
    at = words.index("SolAtVertices") + 1
    count, number = int(words[at]), int(words[at + 1])
    width = _sizes(dim, [int(k) for k in words[at + 2 : at + 2 + number]])
    at += 2 + number
    return dim, np.array(words[at : at + count * width], float).reshape(count, width)


def _sol_binary(data):
    order = "<" if data[:4] == b"\1\0\0\0" else ">"
    (version,) = struct.unpack_from(order + "i", data, 4)
    place = order + ("q" if version >= 3 else "i")
    whole = order + ("q" if version >= 4 else "i")
    real = np.dtype(order + ("f4" if version == 1 else "f8"))
    at, dim = 8, 3
    while at and at + 4 <= len(data):
        (keyword,) = struct.unpack_from(order + "i", data, at)
        (following,) = struct.unpack_from(place, data, at + 4)
        body = at + 4 + struct.calcsize(place)
        if keyword == 3:
            (dim,) = struct.unpack_from(order + "i", data, body)
        elif keyword == 62:
            (count,) = struct.unpack_from(whole, data, body)
            body += struct.calcsize(whole)
            (number,) = struct.unpack_from(order + "i", data, body)
            width = _sizes(dim, struct.unpack_from(f"{order}{number}i", data, body + 4))
            return dim, np.frombuffer(data, real, count * width, body + 4 + 4 * number).reshape(count, width)
        at = following
    raise ValueError("no SolAtVertices")
