"""Images of a cylinder: the integral over each element of the tool's penetration, spread by the covering's point spread.

An image has a row for each position of the tool and a column for each element. Lengths are in mm.
"""

import numpy as np
from scipy.special import erf

from rig import COLUMN_CENTRES_MM, COLUMNS, ELEMENTS, HALF_ELEMENT_MM, ROW_CENTRES_MM, ROWS


def disc(radius_mm, radial=4, around=12):
    """Nodes and weights of a quadrature over a disc: x and y from its middle, and areas in mm^2 whose sum is the disc's."""
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    radii = radius_mm * np.sqrt((nodes + 1) / 2)
    angles = np.arange(around) * 2 * np.pi / around
    x = (radii[:, None] * np.cos(angles)).ravel()
    y = (radii[:, None] * np.sin(angles)).ravel()
    return x, y, np.repeat(weights / 2, around) / around * np.pi * radius_mm**2


def strip(distance_mm, sigma_mm):
    """Share of a normal distribution that falls between two sides of an element, by the distance of their middle."""
    scale = 1 / (np.sqrt(2) * sigma_mm)
    return 0.5 * (erf((distance_mm + HALF_ELEMENT_MM) * scale) - erf((distance_mm - HALF_ELEMENT_MM) * scale))


def gauss_image(x_mm, y_mm, nodes, sigma_mm):
    """The image of a tool of depth 1 mm under a Gaussian point spread; `sigma_mm` is one value or one for each position."""
    sigma = np.broadcast_to(np.asarray(sigma_mm, float), x_mm.shape)
    image = np.zeros((len(x_mm), ROWS, COLUMNS))
    for node_x, node_y, area in zip(*nodes, strict=True):
        along_x = strip(COLUMN_CENTRES_MM[None, :] - (x_mm + node_x)[:, None], sigma[:, None])
        along_y = strip(ROW_CENTRES_MM[None, :] - (y_mm + node_y)[:, None], sigma[:, None])
        image += area * (along_y[:, :, None] * along_x[:, None, :])
    return image.reshape(len(x_mm), ELEMENTS)


def reference(nodes, sigma_mm):
    """What an element reads of the tool at its own centre, 1 mm deep: the unit of all images."""
    at = gauss_image(np.array([COLUMN_CENTRES_MM[3]]), np.array([ROW_CENTRES_MM[2]]), nodes, sigma_mm)
    return at[0, 2 * COLUMNS + 3]


def unique_rows(*columns, scale=1e6):
    """Indices of the first of each group of equal rows, and the group of each row; values count in steps of 1 / `scale`."""
    rows = np.stack([np.round(column * scale).astype(np.int64) for column in columns], axis=1)
    _, first, group = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return first, group.ravel()


def spread_image(scene, kernel=None):
    """The signal in mm of a flat tool under a point spread that does not depend on depth; by default the plain Gaussian."""
    kernel = kernel or (lambda x, y: gauss_image(x, y, scene.nodes, scene.rig.sigma_mm))
    signal = np.zeros((len(scene.t_s), ELEMENTS))
    touching = np.flatnonzero(scene.touches)
    x, y = scene.x_mm[touching], scene.y_mm[touching]
    first, group = unique_rows(x, y)
    signal[touching] = scene.depth_mm[touching][:, None] * kernel(x[first], y[first])[group] / scene.reference
    return signal


def profile_image(scene, nodes, profile, levels=60):
    """The signal in mm of a tool whose penetration at its nodes is `profile(depth)`; interpolated between so many depths.

    The tool stands still in x and y while it touches, so that there are as many places as presses, or a few more.
    """
    signal = np.zeros((len(scene.t_s), ELEMENTS))
    touching = np.flatnonzero(scene.touches)
    node_x, node_y, area = nodes
    first, group = unique_rows(scene.x_mm[touching], scene.y_mm[touching], scale=1e4)
    grid_mm = np.linspace(0, scene.depth_mm.max() * 1.0001, levels)
    profiles = np.stack([profile(depth_mm) for depth_mm in grid_mm])
    for place, index in enumerate(touching[first]):
        along_x = strip(COLUMN_CENTRES_MM[None, :] - (scene.x_mm[index] + node_x)[:, None], scene.rig.sigma_mm)
        along_y = strip(ROW_CENTRES_MM[None, :] - (scene.y_mm[index] + node_y)[:, None], scene.rig.sigma_mm)
        of_nodes = (along_y[:, :, None] * along_x[:, None, :]).reshape(len(node_x), ELEMENTS) * area[:, None]
        images = profiles @ of_nodes / scene.reference
        here = touching[group == place]
        level = np.minimum((scene.depth_mm[here] / grid_mm[1]).astype(int), levels - 2)
        share = (scene.depth_mm[here] / grid_mm[1] - level)[:, None]
        signal[here] = images[level] * (1 - share) + images[level + 1] * share
    return signal
