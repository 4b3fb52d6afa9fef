"""A synthetic person: the generic head pushed about by free-form bumps, with a skin painted in space.

The shape is no member of any linear class of faces, and it is not symmetric. Head frame (x the subject's left, y up,
z out of the face), metres; colours are sRGB, 0…1.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

EYES = np.array([[0.0315, 0.0, 0.0], [-0.0315, 0.0, 0.0]])

# Centre, width (standard deviation), push; millimetres.
FEATURES = [
    ((0, -44, 48), 11, (1.5, -2.0, 4.0)),
    ((0, -15, 32), 10, (-0.5, 0.5, 2.5)),
    ((0, -119, 8), 18, (1.5, -3.0, 3.5)),
    ((62, -85, -25), 26, (-4.5, 0.0, 0.0)),
    ((-62, -85, -25), 26, (-2.0, -1.0, 1.0)),
    ((30, 22, 24), 16, (0.0, -1.0, 3.0)),
    ((-30, 22, 24), 16, (0.0, 1.0, 2.0)),
    ((52, -32, 10), 18, (3.0, 1.0, 1.5)),
    ((-54, -34, 10), 18, (-1.0, 0.0, 3.0)),
    ((0, -72, 34), 14, (0.8, 0.0, 2.0)),
    ((0, 55, 20), 28, (0.0, 2.0, -3.0)),
]
BUMPS, BUMPS_RMS = 60, 0.0022


def push(points: Array, seed: int) -> Array:
    """Where the generic head's points are on the person."""
    random = np.random.default_rng(seed)
    centres = random.uniform([-0.09, -0.15, -0.10], [0.09, 0.12, 0.06], (BUMPS, 3))
    widths = random.uniform(0.024, 0.045, BUMPS)
    pushes = random.standard_normal((BUMPS, 3))

    def field(at: Array) -> Array:
        return _gaussians(at, centres, widths) @ pushes

    face = points[(points[:, 2] > -0.02) & (points[:, 1] > -0.125)]
    strength = BUMPS_RMS / np.sqrt((field(face) ** 2).sum(1).mean())
    named = [np.array([f[k] for f in FEATURES], float) * 1e-3 for k in range(3)]

    def whole(at: Array) -> Array:
        return strength * field(at) + _gaussians(at, named[0], named[1]) @ named[2]

    offset = whole(points)
    # Eyeballs stay spheres, and the lids stay on them: the field is constant about each eye.
    for eye in EYES:
        near = _step(0.036, 0.019, np.linalg.norm(points - eye, axis=1))[:, None]
        offset = offset * (1 - near) + whole(eye[None] + [0, 0, 0.012]) * near
    return points + offset


def paint(positions: Array, size: int, seed: int, quads: NDArray[np.int64], uvs: Array) -> NDArray[np.uint8]:
    """The person's skin as an image of the skin's UV map, (size, size, 4), top row first."""
    inside, points = _texel_positions(positions, quads, uvs, size)
    colours = _skin(points[inside] * 1e3, np.random.default_rng(seed))
    picture = np.full((size, size, 4), 255, np.uint8)
    picture[..., :3] = (190, 145, 125)
    picture[inside, :3] = np.rint(255 * np.clip(colours, 0, 1))
    return _grow(picture, inside)


def _skin(p: Array, random: np.random.Generator) -> Array:
    """Colours of points of the generic head, millimetres."""
    x, y, z = p.T
    front = _step(-25, -5, z)
    colour = np.tile([0.80, 0.615, 0.52], (len(p), 1))
    mottle = 0.035 * _noise(p / 14, random) + 0.045 * _noise(p / 5, random) + 0.05 * _noise(p / 2.2, random)
    colour *= (1 + mottle)[:, None]
    blobs = [_blob(p, c, w) for c, w in (((48, -42, 8), 15), ((-48, -42, 8), 15), ((0, -44, 46), 10))]
    flush = 0.5 * np.sum(blobs, axis=0)
    colour = _over(colour, (0.80, 0.47, 0.41), flush)
    shade = 0.35 * np.sum([_blob(p, (s * 30, -11, 16), 9) for s in (1, -1)], axis=0)
    colour = _over(colour, (0.55, 0.38, 0.36), shade)
    stubble = front * _step(-52, -66, y) * _step(-0.4, 0.9, _noise(p / 1.3, random))
    colour = _over(colour, (0.42, 0.33, 0.30), 0.42 * stubble)
    colour = _speckle(colour, p, random, 900, (0.5, 1.2), (0.15, 0.5), (0.50, 0.30, 0.21))
    colour = _speckle(colour, p, random, 26, (1.1, 2.0), (0.6, 0.9), (0.27, 0.16, 0.12))
    colour = _lips(colour, p, random)
    for side in (1, -1):
        colour = _brow_and_lashes(colour, p * [side, 1, 1], side, random)
    return _hair(colour, p, random)


def _lips(colour: Array, p: Array, random: np.random.Generator) -> Array:
    x, y, z = p.T
    across = np.array([-28, -25, -21, -16, -8, 0, 8, 16, 21, 25, 28], float)
    upper = np.array([-73.5, -71.2, -69.2, -66.8, -64.6, -65.9, -64.9, -67.0, -69.4, -71.3, -73.5])
    lower = np.array([-73.5, -75.9, -79.0, -82.3, -84.6, -85.0, -84.3, -82.0, -78.8, -75.7, -73.5])
    over, under = np.interp(x, across, upper), np.interp(x, across, lower)
    red = _step(-0.7, 0.7, over - y) * _step(-0.7, 0.7, y - under) * _step(12, 18, z) * (np.abs(x) < 27)
    colour = _over(colour, np.array([0.66, 0.34, 0.33]), red * (0.85 + 0.15 * _noise(p / [1.2, 6, 6], random)))
    line = _step(1.0, 0.3, np.abs(y + 72.9)) * (np.abs(x) < 27) * _step(12, 18, z)
    return _over(colour, np.array([0.30, 0.13, 0.13]), 0.8 * line)


def _brow_and_lashes(colour: Array, p: Array, side: int, random: np.random.Generator) -> Array:
    x, y, z = p.T
    lift = 0.8 if side > 0 else -0.4
    ridge = np.interp(x, [11, 20, 30, 43, 52, 60], np.array([13.8, 15.6, 17.2, 18.0, 14.6, 8.8]) + lift)
    half = np.interp(x, [9, 13, 28, 45, 60], [1.5, 4.2, 3.8, 2.8, 0.8])
    hairs = 0.75 + 0.25 * _noise(np.stack([x + 0.8 * y, y / 4, z / 4], 1) / 0.9, random)
    brow = _step(1.15, 0.7, np.abs(y - ridge) / half) * _step(9, 13, x) * _step(62, 58, x) * (z > -15)
    colour = _over(colour, (0.20, 0.13, 0.10), 0.92 * brow * hairs)
    lid_x = [16, 21, 27.5, 34, 40, 46, 49]
    upper = np.interp(x, lid_x, [-4.3, 0.3, 2.4, 2.8, 1.5, -1.0, -3.1])
    lower = np.interp(x, lid_x, [-4.3, -5.6, -6.2, -6.3, -5.9, -4.6, -3.1])
    span = (x > 17) & (x < 49.5) & (z > 2)
    colour = _over(colour, (0.14, 0.09, 0.08), 0.8 * span * _step(1.6, 0.7, np.abs(y - upper - 0.4)))
    return _over(colour, (0.42, 0.26, 0.22), 0.5 * span * _step(1.5, 0.6, np.abs(y - lower + 0.4)))


def _hair(colour: Array, p: Array, random: np.random.Generator) -> Array:
    x, y, z = p.T
    ragged = 3 * _noise(p / 7, random) + 2 * _noise(p / 2.5, random)
    line = np.interp(z, [-140, -95, -70, -45, -25, 0, 30], [-85, -70, -5, 2, 30, 50, 60]) + ragged
    ear = (np.abs(x) > 73) & (z < -44) & (z > -92) & (y < 14)
    covered = _step(-2, 2, y - line) * ~ear
    strands = 0.14 + 0.05 * _noise(p / [1.5, 9, 9], random) + 0.03 * _noise(p / 12, random)
    return _over(colour, strands[:, None] * [1.25, 0.95, 0.75], covered)


def _speckle(
    colour: Array,
    p: Array,
    random: np.random.Generator,
    count: int,
    radii: tuple[float, float],
    strengths: tuple[float, float],
    tint: tuple[float, float, float],
) -> Array:
    """Freckles or moles at random places of the front."""
    front = np.flatnonzero((p[:, 2] > -40) & (p[:, 1] > -125))
    order = np.argsort(p[:, 1])
    heights = p[order, 1]
    for spot in p[random.choice(front, count, replace=False)]:
        radius, strength = random.uniform(*radii), random.uniform(*strengths)
        first, end = np.searchsorted(heights, [spot[1] - 2 * radius, spot[1] + 2 * radius])
        near = order[first:end]
        near = near[(np.abs(p[near] - spot) < 2 * radius).all(1)]
        distance = np.linalg.norm(p[near] - spot, axis=1)
        colour[near] = _over(colour[near], tint, strength * _step(1.5 * radius, 0.6 * radius, distance))
    return colour


def _over(below: Array, colour: Array | tuple[float, ...], alpha: Array) -> Array:
    alpha = np.clip(alpha, 0, 1)[:, None]
    return below * (1 - alpha) + np.asarray(colour) * alpha


def _blob(p: Array, centre: tuple[float, ...], width: float) -> Array:
    return np.exp(-0.5 * ((p - np.array(centre, float)) ** 2).sum(1) / width**2)


def _step(low: float, high: float, value: Array) -> Array:
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def _gaussians(points: Array, centres: Array, widths: Array) -> Array:
    squared = ((points[:, None] - centres) ** 2).sum(2)
    return np.exp(-0.5 * squared / widths**2)


def _noise(points: Array, random: np.random.Generator) -> Array:
    """Value noise of wavelength about 2, −1…1."""
    lattice = random.uniform(-1, 1, (32, 32, 32))
    cell = np.floor(points).astype(np.int64)
    t = points - cell
    t = t * t * (3 - 2 * t)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(np.array(corner) == 1, t, 1 - t), axis=1)
        total += weight * lattice[tuple(((cell + corner) % 32).T)]
    return total


def _texel_positions(
    positions: Array, quads: NDArray[np.int64], uvs: Array, size: int
) -> tuple[NDArray[np.bool_], Array]:
    """Which texels the skin covers, and the point of the head in each."""
    inside, points = np.zeros((size, size), bool), np.zeros((size, size, 3))
    corners = np.stack([uvs[..., 0] * size - 0.5, (1 - uvs[..., 1]) * size - 0.5], -1)
    for quad, uv in zip(quads, corners, strict=True):
        for pick in ([0, 1, 2], [0, 2, 3]):
            _rasterise(uv[pick], positions[quad[pick]], inside, points)
    return inside, points


def _rasterise(uv: Array, corners: Array, inside: NDArray[np.bool_], points: Array) -> None:
    low = np.maximum(np.floor(uv.min(0)).astype(int), 0)
    high = np.minimum(np.ceil(uv.max(0)).astype(int), len(inside) - 1)
    edges = np.stack([uv[1] - uv[0], uv[2] - uv[0]], 1)
    if abs(np.linalg.det(edges)) < 1e-9:
        return
    u, v = np.meshgrid(np.arange(low[0], high[0] + 1), np.arange(low[1], high[1] + 1))
    st = (np.stack([u, v], -1) - uv[0]) @ np.linalg.inv(edges).T
    weights = np.concatenate([1 - st.sum(-1, keepdims=True), st], -1)
    hit = (weights > -1e-6).all(-1)
    inside[v[hit], u[hit]] = True
    points[v[hit], u[hit]] = weights[hit] @ corners


def _grow(picture: NDArray[np.uint8], inside: NDArray[np.bool_], rounds: int = 6) -> NDArray[np.uint8]:
    """Colours carried a few texels beyond the charts, for filtering across their borders."""
    for _ in range(rounds):
        for shift, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
            source = np.roll(inside, shift, axis) & ~inside
            picture[source] = np.roll(picture, shift, axis)[source]
            inside = inside | source
    return picture
