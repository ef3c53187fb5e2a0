"""A drawing becomes a density: both mappings, on hand-drawn scenes."""

import numpy as np
import pytest

from swarm_pz.errors import CommandError
from swarm_pz.kernels.painting import paint
from swarm_pz.play.strokes import BRUSHES, MOST_INK, MOST_POINTS, NARROWEST, SMOOTHING, WIDEST, Stroke, density_of
from swarm_pz.simulator.commands import interpolation_matrix


def line(*points, brush="attract", width=0.1):
    return Stroke(brush=brush, width=width, points=points)


def ring(x, y, radius, **options):
    angles = np.linspace(0, 2 * np.pi, 60)
    return line(*zip(x + radius * np.cos(angles), y + radius * np.sin(angles), strict=True), **options)


def other_density(strokes, cells, untouched, smoothing, pixels=100):
    """Paint by distances to 200 places of each piece, smooth with a mirrored image, take means over the cells."""
    image = np.full((pixels, pixels), untouched)
    y, x = (np.mgrid[:pixels, :pixels] + 0.5) / pixels
    for stroke in strokes:
        for (ax, ay), (bx, by) in list(zip(stroke.points, stroke.points[1:], strict=False)) or [stroke.points * 2]:
            for step in np.linspace(0, 1, 200):
                distance = np.hypot(ax + step * (bx - ax) - x, ay + step * (by - ay) - y)
                value = {"attract": 1.0, "repel": 0.0, "erase": untouched}[stroke.brush]
                image[distance <= stroke.width / 2] = value
    kernel = np.exp(-(np.arange(-pixels, pixels + 1) ** 2) / (2 * (smoothing * pixels) ** 2))
    kernel /= kernel.sum()
    for axis in (0, 1):
        widened = np.pad(image, [(pixels, pixels) if a == axis else (0, 0) for a in (0, 1)], mode="symmetric")
        image = np.apply_along_axis(np.convolve, axis, widened, kernel, "valid")
    return image.repeat(cells, 0).repeat(cells, 1).reshape(cells, pixels, cells, pixels).mean(axis=(1, 3))


@pytest.mark.parametrize("cells", [10, 7])
def test_a_drawing_is_painted_smoothed_and_averaged(cells):
    strokes = [line((0.2, 0.3), (0.61, 0.74)), line((0.45, 0.5), brush="erase", width=0.3)]
    strokes.append(line((0.9, 0.1), (0.95, 0.2), width=0.05))
    np.testing.assert_allclose(density_of(strokes, cells), other_density(strokes, cells, 0.0, 0.05), atol=2e-3)
    strokes.append(line((0.45, 0.5), brush="repel", width=0.3))
    np.testing.assert_allclose(density_of(strokes, cells, "paper"), other_density(strokes, cells, 0.5, 0.2), atol=2e-3)


@pytest.mark.parametrize("mapping", SMOOTHING)
def test_a_blank_page_means_uniform_coverage(mapping):
    blank = density_of([], 10, mapping)
    np.testing.assert_allclose(blank, blank[0, 0])
    erased = density_of([line((0.5, 0.5)), line((0.5, 0.5), brush="erase")], 10, mapping)
    np.testing.assert_array_equal(erased, blank)


def test_untouched_ground_is_wanted_only_where_nothing_attracts():
    away = line((0.1, 0.1), brush="repel")
    assert density_of([away], 10)[9, 9] == pytest.approx(0.5)
    assert density_of([away, line((0.5, 0.5))], 10)[9, 9] == pytest.approx(0.0, abs=1e-9)
    assert density_of([away, line((0.5, 0.5))], 10, "paper")[9, 9] > 0.45


def target_of(strokes):
    """Return the target of a drawing, on a fine grid."""
    fine = interpolation_matrix(400, 10)
    target = fine @ density_of(strokes, 10) @ fine.T
    return target / target.sum()


@pytest.mark.parametrize("cells", [5, 10])
def test_ground_that_repels_is_empty_up_to_its_edge_and_nothing_flows_into_it(cells):
    strokes = [line((0.3, 0.5), (0.7, 0.5), width=0.3), line((0.5, 0.0), (0.5, 1.0), brush="repel", width=0.3)]
    density = density_of(strokes, cells)
    assert density[:, cells // 2].max() < 0.05 < 0.3 < density.max()
    wanted = ring(0.4, 0.5, 0.2)
    beside = line((0.7, 0.2), (0.7, 0.8), brush="repel", width=0.15)
    alone, kept = (target_of(drawn)[:, 260:300].sum() for drawn in ([wanted], [wanted, beside]))
    assert kept < 0.3 * alone


NO_STROKES = [
    {"brush": "attrackt"}, {"width": 0.5}, {"width": float("nan")}, {"points": ()}, {"points": ((0.5, float("nan")),)},
    {"points": ((7.0, 0.5),)}, {"points": ((0.5, 0.5),) * (MOST_POINTS + 1)},
]  # fmt: skip


@pytest.mark.parametrize("what", NO_STROKES)
def test_what_cannot_be_drawn_is_refused(what):
    with pytest.raises(CommandError):
        Stroke(**{"brush": BRUSHES[0], "width": 0.1, "points": ((0.5, 0.5),)} | what)


def test_endless_drawings_are_refused():
    long = line(*[(0.5, 0.5)] * MOST_POINTS)
    with pytest.raises(CommandError, match="points"):
        density_of([long, long], 10)


@pytest.mark.parametrize("width", [NARROWEST, WIDEST])
def test_a_drawing_has_so_much_ink_and_no_more(width):
    across = int(MOST_INK / width / 1.25)  # lines of 1.25, there and back
    zigzag = line(*[(-0.125 + 1.25 * (k % 2), 0.5) for k in range(across + 1)], width=width)
    assert density_of([zigzag], 10)[5, 5] > 0.1
    with pytest.raises(CommandError, match="100"):
        density_of([zigzag, line((0.0, 0.0), (1.0, 1.0), width=width)], 10)


def test_what_is_at_a_limit_is_drawn():
    edges = line((-0.5, -0.5), (1.5, 1.5), width=NARROWEST)
    longest = line(*[(0.5, 0.5)] * (MOST_POINTS - 2), width=WIDEST)
    assert density_of([edges, longest], 10).max() > 0.5


@pytest.mark.parametrize("reach", [2.5, 15.0])
def test_lines_paint_the_pixels_within_their_reach_wherever_they_lie(reach):
    chance = np.random.default_rng(1)
    rows, columns = np.mgrid[:40, :40] + 0.5
    for _ in range(50):
        ends = np.round(chance.uniform(-20.0, 60.0, (2, 2)))
        image = chance.integers(0, 3, (40, 40)).astype(np.int8)
        (ax, ay), (dx, dy) = ends[0], ends[1] - ends[0]
        share = np.clip(((columns - ax) * dx + (rows - ay) * dy) / max(dx * dx + dy * dy, 1e-9), 0.0, 1.0)
        distance = np.hypot(columns - ax - share * dx, rows - ay - share * dy)
        sure = np.abs(distance - reach) > 1e-6
        expected = np.where(distance < reach, 1, image)
        paint(image, ends, reach, 1)
        np.testing.assert_array_equal(image[sure], expected[sure])
