"""Claims are judged by their own numbers, and the numbers can be had by other means."""

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from lab.benchmarks import run_benchmarks
from lab.claims import settings
from lab.claims.claim import Claim, Outcome, Verdict, bootstrap_ci95
from lab.claims.outliers import brute_force_keep, with_gross_outliers
from lab.claims.registry import CLAIMS, run_claims
from lab.claims.surface.clouds import single_node
from packetmesh.errors import InputError
from packetmesh.progress import Progress
from pipeline.acquisition import filter_outliers
from pipeline.config import AcquisitionConfig
from pipeline.io.demos import load_demo
from pipeline.types import DepthMap, PointCloud

SPEC = Path(__file__).parents[3] / "docs" / "SPEC.md"


def test_a_claim_is_reproduced_only_if_its_experiment_says_so():
    for reproduced, verdict in ((True, "reproduced"), (False, "not reproduced")):
        outcome = Outcome({"x": 1.0}, {}, reproduced, "because")
        assert Claim("C0", "claim", "1", "exact", lambda outcome=outcome: outcome).judge().verdict == verdict


def test_a_claim_of_ours_holds_or_does_not():
    for holds, verdict in ((True, "holds"), (False, "does not hold")):
        outcome = Outcome({"x": 1.0}, {}, holds, "because")
        assert (
            Claim("D00", "claim", "ours", "exact", lambda outcome=outcome: outcome).judge().verdict == verdict
        )


def test_what_is_true_by_definition_is_no_finding_but_what_is_false_is():
    for reproduced, verdict in ((True, "true by definition"), (False, "not reproduced")):
        outcome = Outcome({}, {}, reproduced, "because")
        claim = Claim("C0", "claim", "1", "exact", lambda outcome=outcome: outcome, by_definition=True)
        assert claim.judge().verdict == verdict


def test_what_nothing_can_test_has_no_verdict_for_or_against():
    for name in ("C0", "D0"):
        claim = Claim(name, "claim", "1", "exact", lambda: Outcome({}, {}, None, "because"))
        assert claim.judge().verdict == "cannot be tested"


def test_settings_are_true_by_definition_and_others_work_cannot_be_tested():
    verdicts = {event.id: event for event in run_claims(["C09", "C11", "C37"]) if isinstance(event, Verdict)}
    assert verdicts["C09"].verdict == "true by definition"
    assert verdicts["C09"].ours["seconds_an_image"] == pytest.approx(921_615 * 8 / 250_000)
    assert {verdicts[name].verdict for name in ("C11", "C37")} == {"cannot be tested"}


def test_c09_counts_the_images_that_have_the_size(monkeypatch):
    frame = load_demo("office").frames[0]
    small = replace(frame, rgb=frame.rgb[:240, :320], depth=DepthMap(frame.depth.z_m[:240, :320]))
    monkeypatch.setattr(settings, "DEMO_SCENES", ("office",))
    monkeypatch.setattr(settings, "load_demo", lambda name: SimpleNamespace(frames=(frame, frame, small)))
    verdict = CLAIMS["C09"].judge()
    assert verdict.verdict == "not reproduced"
    assert verdict.why.startswith("2 of 3 images of the demo scenes have 640 x 480 pixels")


def test_all_trials_are_run_only_where_they_are_asked_for(monkeypatch, tmp_path):
    def trials(count):
        def prepare(folder, scheduler):
            yield Progress("trials", 1.0)
            return count

        return prepare

    claim = Claim("D00", "c", "t", "tol", _counts, trials(3), trials(50))
    monkeypatch.setitem(CLAIMS, "D00", claim)
    for full, count in ((False, 3.0), (True, 50.0)):
        assert list(run_claims(["D00"], tmp_path, full=full))[-1].ours == {"trials": count}


def _counts(count):
    return Outcome({"trials": float(count)}, {}, True, "counted")


def test_the_record_holds_what_the_report_promises():
    record = (
        Claim("C0", "c", "t", "tol", lambda: Outcome({"x": 1.0}, {"x": (0.5, 2.0)}, True, "w"))
        .judge()
        .record()
    )
    assert {"thesis", "ours", "ci95", "tolerance", "verdict", "why"} <= set(record)


def test_the_bootstrap_interval_covers_the_mean_95_times_of_100():
    rng = np.random.default_rng(5)
    covered = [
        low <= 3.0 <= high for low, high in (bootstrap_ci95(rng.normal(3, 1, 40), seed=k) for k in range(400))
    ]
    assert 0.90 <= np.mean(covered) <= 0.98


def test_a_constant_has_an_interval_of_no_width():
    assert bootstrap_ci95(np.full(12, 0.25)) == (0.25, 0.25)


def test_the_outlier_filter_keeps_what_the_printed_formulae_keep():
    rng = np.random.default_rng(2)
    points_m = np.concatenate([rng.normal(0, 0.2, (800, 3)), rng.uniform(-3, 3, (40, 3))])
    points_m[:, 2] += 3.0
    config = AcquisitionConfig(outlier_mode="thesis", outlier_neighbours=4, outlier_t=1.0)
    keep = filter_outliers(PointCloud(points_m), config, 525.0).keep
    np.testing.assert_array_equal(keep, brute_force_keep(points_m, 4, 1.0))
    assert 0 < (~keep).sum() < 200


def test_gross_outliers_move_along_their_rays_and_are_about_one_in_a_hundred():
    points_m = np.random.default_rng(3).uniform(1, 2, (20_000, 3))
    moved_m, moved = with_gross_outliers(PointCloud(points_m), np.random.default_rng(4))
    np.testing.assert_array_equal(moved_m[~moved], points_m[~moved])
    np.testing.assert_allclose(np.cross(moved_m, points_m), 0, atol=1e-12)
    assert 0.007 < moved.mean() < 0.013


def test_a_single_node_stands_at_its_true_pose_with_its_own_truth():
    rig = load_demo("box-on-table")
    alone = single_node(rig, 2)
    np.testing.assert_array_equal(alone.frames[0].T_world_camera, rig.truth.T_world_camera[2])
    assert len(alone.truth.depth) == len(alone.frames) == 1


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match="C10"):
        list(run_claims(["C99"]))
    with pytest.raises(InputError, match="chain: a rig of three"):
        list(run_benchmarks(["nothing"]))


def test_the_claims_are_rows_of_the_specification_s_table():
    rows = dict(re.findall(r"^\| ([CD]\d+) \| (.*)$", SPEC.read_text("utf-8"), re.MULTILINE))
    assert list(CLAIMS) == sorted(set(CLAIMS) & set(rows))
    assert set(CLAIMS) == set(rows)
    for name, claim in CLAIMS.items():
        assert claim.id == name
        assert all(len(text) > 3 for text in (claim.claim, claim.thesis, claim.tolerance))
