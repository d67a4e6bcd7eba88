"""What the jobs of the Depth screen answer: pictures, residuals, confidence, and the hidden disc."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from app.compute.records import SENSOR_POINTS
from app.compute.state import Spec
from app.drawing.colors import HOLE
from app.drawing.pictures import UNKNOWN, confidence_colors
from app.screens.depth.discs import window_around
from app.screens.depth.hide_job import LEAST_HIDDEN_PX, accepted_depth, fill_row, hidden_pixels, hide_job
from app.screens.depth.job import depth_job, judged_view, residual_view
from app.screens.depth.labels import AS_IN_FILE, FILLS, NETWORK_PRESETS, PICTURES
from app.screens.depth.model_job import model_job
from app.screens.depth.view import Disc, HideRequest, ModelChoice, SeenSample
from packetmesh.errors import InputError
from packetmesh.progress import drain as end
from pipeline.acquisition import acquire
from pipeline.config import DepthConfig
from pipeline.depth import DepthNetwork, complete
from pipeline.depth.confidence import judge
from pipeline.depth.conventions import PRESETS
from pipeline.depth.fillers import PEERS
from pipeline.depth.inference import SHIPPED_MODEL
from pipeline.sources import Demo
from pipeline.types import DepthMap

SPEC = Spec(Demo("box-on-table"))
FLAT = HideRequest(0, (Disc(0.15, 0.35, 0.2),))
"""On the wall, where depth is a plane."""


@pytest.fixture(scope="module")
def rig(store):
    return end(store.stage(SPEC, "rig"))


@pytest.fixture(scope="module")
def view(store):
    return end(depth_job(store, SPEC))


@pytest.fixture(scope="module")
def hidden(store):
    return end(hide_job(store, SPEC, FLAT))


def colored(picture, color):
    return np.all(picture.rgb == color, axis=-1)


def test_every_node_has_all_five_pictures_of_one_size(rig, view):
    assert [node.name for node in view.nodes] == [frame.name for frame in rig.frames]
    for frame, node in zip(rig.frames, view.nodes, strict=True):
        assert tuple(node.pictures) == tuple(PICTURES)
        assert {picture.rgb.shape for picture in node.pictures.values()} == {frame.rgb.shape}
        np.testing.assert_array_equal(node.pictures["photo"].rgb, frame.rgb)
        assert [name for name, picture in node.pictures.items() if picture.bar is None] == ["photo"]


def test_what_is_unknown_is_marked_in_each_picture(store, rig, view):
    for frame, clouds, node in zip(rig.frames, end(store.stage(SPEC, "nodes")), view.nodes, strict=True):
        measured, inferred = frame.depth.valid, clouds.alignment.depth.valid
        np.testing.assert_array_equal(colored(node.pictures["sensor"], HOLE), ~measured)
        np.testing.assert_array_equal(colored(node.pictures["inferred"], HOLE), ~inferred)
        np.testing.assert_array_equal(colored(node.pictures["difference"], UNKNOWN), ~(measured & inferred))
        assert not np.any(colored(node.pictures["confidence"], UNKNOWN) & measured & inferred)


def test_wide_images_are_thinned_alike(store, rig, monkeypatch):
    monkeypatch.setattr("app.screens.depth.job.PICTURE_WIDTH_PX", rig.frames[0].rgb.shape[1] // 2)
    node = end(depth_job(store, SPEC)).nodes[0]
    assert {picture.rgb.shape for picture in node.pictures.values()} == {rig.frames[0].rgb[::2, ::2].shape}
    np.testing.assert_array_equal(node.pictures["photo"].rgb, rig.frames[0].rgb[::2, ::2])


def test_the_confidence_of_every_drawn_point_is_that_of_its_pixel(store, rig, view):
    config = SPEC.config.depth
    for frame, clouds, node in zip(rig.frames, end(store.stage(SPEC, "nodes")), view.nodes, strict=True):
        completed = complete(frame.depth, frame.rgb)
        limits = config.reach, config.least_confidence
        judged = judge(clouds.alignment, frame.depth, frame.rgb, *limits, completed)
        rows = {tuple(point): row for row, point in enumerate(clouds.inferred.points_m.astype(np.float32))}
        for drawn, colors in (
            (node.inferred, node.inferred_confidence),
            (node.filled, node.filled_confidence),
        ):
            assert len(drawn.points_m) == len(colors) > 0
            u, v = clouds.inferred.pixels[[rows[tuple(point)] for point in drawn.points_m]].T
            np.testing.assert_array_equal(colors, confidence_colors(judged.confidence[v, u]))


def test_the_drawn_sensor_points_know_their_pixels(rig, view):
    for frame, node in zip(rig.frames, view.nodes, strict=True):
        seen = node.sensor
        assert isinstance(seen, SeenSample)
        assert (seen.height_px, seen.width_px) == frame.depth.z_m.shape
        u, v = seen.pixels.T
        depth = acquire(frame, SPEC.config.acquisition).depth
        np.testing.assert_allclose(seen.points_m[:, 2], depth.z_m[v, u], rtol=1e-6)
        np.testing.assert_array_equal(seen.colors, frame.rgb[v, u])
        step = round(seen.spacing * frame.intrinsics.fx_px)
        valid = depth.valid[::step, ::step]
        assert len(seen.points_m) + len(node.outliers.points_m) == valid.sum()
        assert sum(len(one.sensor.points_m) for one in view.nodes) <= SENSOR_POINTS < step**2 * 250_000


def test_the_residuals_are_those_of_the_alignment(store, view):
    for clouds, node in zip(end(store.stage(SPEC, "nodes")), view.nodes, strict=True):
        assert node.residuals.rms_m == pytest.approx(clouds.alignment.residual_rms_m, rel=1e-5)
        assert abs(node.residuals.median_m) < node.residuals.rms_m


def test_a_residual_view_has_known_numbers_and_loses_no_pixel():
    sensor = DepthMap(np.full((10, 10), 2.0, np.float32))
    aligned = DepthMap(np.full((10, 10), 2.01, np.float32))
    aligned.z_m[0, :2] = (1.5, 5.0)
    sensor.z_m[9] = np.nan
    residuals = residual_view(aligned, sensor)
    assert residuals.counts.sum() == 90
    assert residuals.median_m == pytest.approx(0.01, abs=1e-6)
    assert residuals.rms_m == pytest.approx(np.sqrt((88 * 0.01**2 + 0.5**2 + 3.0**2) / 90), rel=1e-5)
    np.testing.assert_allclose(residuals.edges_m, -residuals.edges_m[::-1])
    assert (residuals.counts[0], residuals.counts[-1]) == (1, 1)


def test_nothing_shared_gives_empty_residuals_and_no_trust_to_tell_of():
    empty = DepthMap(np.full((4, 4), np.nan, np.float32))
    residuals = residual_view(empty, empty)
    assert (residuals.counts.sum(), np.isnan(residuals.median_m), np.isnan(residuals.rms_m)) == (
        0,
        True,
        True,
    )
    assert np.isnan(judged_view(SimpleNamespace(), np.zeros((4, 4), bool)).kept_share)


def test_trust_counts_only_where_the_sensor_is_blind():
    z_m = np.array([[1.0, np.nan], [2.0, np.nan]], np.float32)
    flying = np.array([[True, True], [False, False]])
    judged = SimpleNamespace(depth=DepthMap(z_m), flying=flying, out_of_reach=~flying)
    shares = judged_view(judged, np.array([[False, True], [True, True]]))
    assert (shares.kept_share, shares.flying_share, shares.out_of_reach_share) == pytest.approx(
        (1 / 3, 1 / 3, 2 / 3)
    )


def test_a_disc_is_round_and_holds_measured_pixels_only():
    z_m = np.ones((60, 80), np.float32)
    z_m[:, :40] = np.nan
    disc = hidden_pixels(DepthMap(z_m), (Disc(0.5, 0.5, 0.5),))
    assert not disc[:, :40].any()
    y, x = np.nonzero(disc)
    assert np.hypot(x - 39.5, y - 29.5).max() <= 20.0
    assert disc.sum() == pytest.approx(np.pi * 20.0**2 / 2, rel=0.03)


def test_discs_hide_what_any_of_them_covers():
    depth = DepthMap(np.ones((60, 80), np.float32))
    left, right = Disc(0.3, 0.5, 0.3), Disc(0.5, 0.5, 0.3)
    one, other = hidden_pixels(depth, (left,)), hidden_pixels(depth, (right,))
    assert np.any(one & other)
    np.testing.assert_array_equal(hidden_pixels(depth, (left, right)), one | other)
    np.testing.assert_array_equal(hidden_pixels(depth, (right, left, left)), one | other)


@pytest.mark.parametrize("disc", [Disc(0.1, 0.5, 0.2), Disc(0.9, 0.5, 0.04)])
def test_a_disc_without_measured_pixels_is_one_sentence(disc):
    z_m = np.ones((60, 80), np.float32)
    z_m[:, :40] = np.nan
    with pytest.raises(InputError, match=f"the test needs {LEAST_HIDDEN_PX}: move it off the holes"):
        hidden_pixels(DepthMap(z_m), (disc,))


def test_errors_of_a_fill_have_known_values():
    measured_m = np.array([1.0, 2.0, 4.0, 1.0])
    row = fill_row("x", np.array([1.04, 2.2, np.nan, 1.0]), measured_m, 0.5)
    assert (row.abs_rel, row.within_share, row.filled_share) == pytest.approx((0.14 / 3, 0.5, 0.75))
    nothing = fill_row("x", np.full(4, np.nan), measured_m, 0.5)
    assert np.isnan(nothing.abs_rel)
    assert (nothing.within_share, nothing.filled_share) == (0.0, 0.0)


def test_the_hidden_disc_is_blank_then_filled_and_nothing_else_changes(rig, hidden):
    disc = hidden_pixels(rig.frames[0].depth, FLAT.discs)
    assert hidden.hidden_px == disc.sum() > 1000
    assert hidden.node == rig.frames[0].name
    names = ["ours", "network", *PEERS]
    assert [row.name for row in hidden.rows] == names
    assert list(hidden.pictures) == ["measured", "hidden", *names]
    before, blank = hidden.pictures["measured"], hidden.pictures["hidden"]
    changed = np.any(before.rgb != blank.rgb, axis=-1)
    times = round(np.sqrt(changed.sum() / disc.sum()))
    assert changed.sum() == times**2 * disc.sum()
    assert np.all(colored(blank, HOLE)[changed])
    for row in hidden.rows:
        after = hidden.pictures[row.name]
        np.testing.assert_array_equal(after.rgb[~changed], before.rgb[~changed])
        assert colored(after, HOLE)[changed].mean() == pytest.approx(1.0 - row.filled_share)


def test_the_pictures_show_the_region_around_all_discs(store, rig):
    discs = (Disc(0.15, 0.35, 0.1), Disc(0.45, 0.35, 0.1))
    both = end(hide_job(store, SPEC, HideRequest(0, discs)))
    assert both.hidden_px == hidden_pixels(rig.frames[0].depth, discs).sum()
    rows, columns = window_around(discs, *rig.frames[0].rgb.shape[1::-1])
    shown = both.pictures["hidden"].rgb
    assert shown.shape[1] / shown.shape[0] == pytest.approx(
        (columns.stop - columns.start) / (rows.stop - rows.start)
    )
    hidden = colored(both.pictures["hidden"], HOLE) & ~colored(both.pictures["measured"], HOLE)
    middle = shown.shape[1] // 2
    assert hidden[:, :middle].any()
    assert hidden[:, middle:].any()


def test_a_flat_wall_comes_back(hidden):
    errors = {row.name: row for row in hidden.rows}
    for name in ("nearest", "inpaint-telea"):
        assert errors[name].filled_share == 1.0
        assert errors[name].abs_rel < 0.1
    assert errors["ours"].filled_share > 0.8
    assert errors["ours"].abs_rel < 0.15


def test_a_network_that_knows_the_truth_gives_back_what_was_hidden(rig):
    frame, truth = rig.frames[0], rig.truth.depth[0]
    disc = hidden_pixels(frame.depth, FLAT.discs)
    rest = DepthMap(np.where(disc, np.float32(np.nan), frame.depth.z_m))
    knowing = DepthMap((0.4 * truth.z_m).astype(np.float32), kind="relative")
    filled = accepted_depth(knowing, rest, frame.rgb, replace(DepthConfig(), alignment="affine_depth"))
    row = fill_row("x", filled.z_m[disc], truth.z_m[disc], 0.0)
    assert row.abs_rel < 0.005
    assert row.within_share > 0.95


def test_a_node_that_is_not_there_is_one_sentence(store):
    with pytest.raises(InputError, match="There is no node 7"):
        end(hide_job(store, SPEC, replace(FLAT, node=7)))


def test_the_words_of_the_screen_are_those_of_the_pipeline():
    assert set(NETWORK_PRESETS) == {AS_IN_FILE, *PRESETS}
    assert set(FILLS) == {"measured", "hidden", "ours", "shipped", "network", *PEERS}


def test_the_network_that_ships_says_what_it_is():
    view = end(model_job(None, SPEC, ModelChoice()))
    assert (view.choice, view.kind) == (ModelChoice(), "relative")
    assert view.provider.endswith("ExecutionProvider")
    assert view.size_bytes == SHIPPED_MODEL.stat().st_size
    assert 0.0 < view.inference_s < 30.0


def test_a_chosen_model_is_fed_as_its_choice_says(tmp_path):
    networks = pytest.importorskip("tests.pipeline.depth.networks")
    file = networks.input_side(tmp_path / "n.onnx", 3)
    request = ModelChoice(str(file), None, "metric", 96, 64, "unit")
    assert end(model_job(None, SPEC, request)).choice == request
    convention = DepthNetwork.of(request.put_into(DepthConfig())).convention
    assert (convention.width_px, convention.height_px, convention.normalised_inside) == (96, 64, True)


@pytest.mark.parametrize(
    ("width_px", "height_px", "sentence"),
    [
        (300, 256, "multiples of 32 pixels, not 300 x 256; try 288 x 256"),
        (300, None, "only one is set, to 300; try both"),
        (-32, 32, "depth.input_width_px is -32; try at least 1"),
        (8192, 8192, "8192 x 8192 pixels; give sides of 1 to 4096"),
    ],
)
def test_a_bad_input_size_is_one_sentence(tmp_path, width_px, height_px, sentence):
    networks = pytest.importorskip("tests.pipeline.depth.networks")
    file = networks.input_side(tmp_path / "n.onnx", 3)
    with pytest.raises(InputError, match=sentence) as refused:
        end(model_job(None, SPEC, ModelChoice(str(file), "midas-small", None, width_px, height_px)))
    assert "\n" not in str(refused.value)


def test_a_file_that_is_no_network_is_one_sentence(tmp_path):
    path = tmp_path / "mine.onnx"
    path.write_bytes(b"not a network")
    with pytest.raises(InputError, match=r"mine\.onnx is not a readable ONNX network"):
        end(model_job(None, SPEC, ModelChoice(str(path))))
