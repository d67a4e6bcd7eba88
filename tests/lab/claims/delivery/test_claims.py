"""D01 to D08 and D11 follow their numbers: made-up trials whose answers are known."""

import json

import numpy as np
import pytest

from lab.claims.claim import Verdict
from lab.claims.delivery import cameras, pieces
from lab.claims.delivery.claims import CLAIMS
from lab.claims.delivery.setup import HEADLINE, SEEDS, loss_tasks, send_tasks
from lab.claims.delivery.study import Study
from lab.results.pages import results_page
from lab.results.record import Record, rounded
from packetmesh.files import finite

RATES = {"raw": 0.3, "tiles": 0.2, "layered": 0.1, "exact": 0.05}
"""Points of fused F-score for each per cent lost."""
BYTES = {"layered": 1_100_000.0, "exact": 400_000.0, "jpeg": 1_000_000.0}
RIG_LEVELS = {"living-room": 0.95, "box-on-table": 0.9, "office": 0.93, "workshop": 0.85}


def made_up(rates=RATES, bytes_sent=BYTES, fusion_gain=lambda lost: 0.1 + 0.002 * lost):
    """A study in which every loss costs what it is said to, exactly."""

    def values(task):
        lost = 100.0 * task.share
        f = RIG_LEVELS[task.rig] - rates.get(task.coding, 1.0) * lost / 100.0
        no_hit = 0.15 + 0.002 * lost
        local = task.alignment == "local"
        size = bytes_sent.get(task.coding, 4_000_000.0)
        return {
            "f_before": f - (0.01 if local else -0.01),
            "f_after": f,
            "heard": 3,
            "no_hit_before": no_hit,
            "no_hit_after": no_hit - fusion_gain(lost),
            **{f"hole_area_m2_{when}": 0.5 for when in ("before", "after")},
            **{f"median_depth_error_m_{when}": None for when in ("before", "after")},
            "bytes_sent": size,
            "bytes_delivered": size * (1 - task.share),
            "packets": 1000.0,
            "packets_lost": 1000.0 * task.share,
            "core_s": 8.0,
        }

    same = {"f_before": 0.9, "f_after": 0.9, "no_hit_before": 0.2, "no_hit_after": 0.2}
    sent = {"bytes": 1e6, "packets": 700, "air_bytes": 1.2e6, "attempts_lost": 70, "seconds": 2.0}
    joules = {"radio_j": 3.0, "platform_j": 9.0}
    return Study(
        {task: values(task) for task in loss_tasks()},
        dict.fromkeys(RIG_LEVELS, same),
        {task: sent | joules if task.coding != "raw" else {"bytes": 5e6} for task in send_tasks()},
    )


def judged(study):
    return {claim.id: claim.judge(study) for claim in CLAIMS}


def test_the_exchange_rates_are_those_of_the_trials():
    verdict = judged(made_up())["D01"]
    for coding in HEADLINE:
        rate = RATES[coding]
        name = f"points_per_percent_{coding}_fused"
        assert verdict.ours[name] == pytest.approx(rate)
        assert verdict.ci95[name] == pytest.approx((rate, rate))
    assert verdict.ours["raw_less_tiles_fused"] == pytest.approx(0.1)
    assert verdict.verdict == "holds"
    assert judged(made_up(RATES | {"layered": 0.25}))["D01"].verdict == "does not hold"


def test_a_rate_reads_in_bytes_seconds_and_joules_too():
    rates = judged(made_up())["D01"].exhibits[0]
    by_coding = {row[0]: row for row in rates.rows}
    tiles = dict(zip(rates.header, by_coding["Tiles that stand alone"], strict=True))
    assert tiles["costs points, fused"] == "0.200 [0.200, 0.200]"
    assert (tiles["kB, 802.11b"], tiles["s, 802.11b"]) == (pytest.approx(10.0), pytest.approx(0.02))
    assert tiles["J radios, 802.15.4"] == pytest.approx(0.03)
    raw = dict(zip(rates.header, by_coding["Raw, depth first"], strict=True))
    assert raw["s, 802.11b"] is None


def test_the_aim_is_judged_by_what_is_kept_and_by_its_bytes():
    study = made_up()
    verdict = judged(study)["D02"]
    kept = np.mean([1.0 - 0.01 / level for level in RIG_LEVELS.values()])
    assert verdict.ours["kept_layered"] == pytest.approx(kept)
    assert verdict.ours["bytes_over_jpeg"] == pytest.approx(1.1)
    assert verdict.verdict == "holds"
    lossy, large = made_up(RATES | {"layered": 0.6}), made_up(bytes_sent=BYTES | {"layered": 1_400_000.0})
    for other in (lossy, large):
        assert judged(other)["D02"].verdict == "does not hold"
        assert "not reached" in judged(other)["D02"].why


def test_the_aim_of_exact_is_judged_in_the_same_way():
    verdict = judged(made_up())["D11"]
    kept = np.mean([1.0 - 0.005 / level for level in RIG_LEVELS.values()])
    assert verdict.ours["kept_exact"] == pytest.approx(kept)
    assert verdict.ours["bytes_over_jpeg"] == pytest.approx(0.4)
    assert verdict.verdict == "holds"
    assert verdict.why.endswith("; for comparison, layered keeps 98.9%")
    lossy, large = made_up(RATES | {"exact": 0.15}), made_up(bytes_sent=BYTES | {"exact": 460_000.0})
    assert {judged(other)["D11"].verdict for other in (lossy, large)} == {"does not hold"}


def test_the_hypotheses_follow_their_trials():
    verdicts = judged(made_up())
    assert {verdicts[name].verdict for name in ("D03", "D04", "D05", "D06")} == {"holds"}
    assert verdicts["D04"].ours["gain_per_percent_raw"] == pytest.approx(0.2)
    assert verdicts["D05"].ours["gain_local_0.25"] == pytest.approx(1.0)
    shrinking = judged(made_up(fusion_gain=lambda lost: 0.1 - 0.005 * lost))
    assert shrinking["D03"].verdict == shrinking["D04"].verdict == "does not hold"


def test_all_shares_of_a_seed_are_one_repetition():
    study = made_up()
    tasks = study.tasks("tiles", rigs=("office",))
    assert len(tasks) > len({task.seed for task in tasks}) == SEEDS
    terms = study.terms_by_seed(tasks, lambda task: 3.0 * study.lost_percent(task))
    assert terms.shape == (SEEDS, 2)
    assert terms[:, 0] == pytest.approx(3.0 * terms[:, 1])
    shares = np.array([task.share for task in tasks if task.seed == 1])
    assert terms[1, 1] == pytest.approx(np.sum((100.0 * shares) ** 2))


def test_with_equal_seeds_and_rigs_d04_has_an_interval_of_no_width():
    """Although the shares of a seed, one repetition, lie on no line, and one seed has larger shares too."""
    verdict = judged(made_up(fusion_gain=lambda lost: 0.1 + 1e-4 * lost**2))["D04"]
    lost = np.array([0.5, 1.0, 2.0, 5.0, 10.0])
    slope = 0.01 * np.sum(lost**3) / np.sum(lost**2)
    for coding in HEADLINE:
        name = f"gain_per_percent_{coding}"
        assert (verdict.ours[name], *verdict.ci95[name]) == pytest.approx((slope,) * 3)


def test_what_fusion_makes_of_no_colour_is_seen():
    study = made_up()
    study.colorless["office"] = study.colorless["office"] | {"no_hit_after": 0.19}
    verdict = judged(study)["D06"]
    assert verdict.verdict == "does not hold"
    assert verdict.ours["largest_change"] == pytest.approx(0.01)


def test_a_trial_without_a_surface_leaves_the_record_readable():
    study = made_up()
    png = next(task for task in study.losses if task.coding == "png" and task.share)
    nothing = {"f_before": 0.0, "f_after": 0.0, "no_hit_before": 1.0, "no_hit_after": 1.0, "heard": 0}
    study.losses[png] |= nothing
    verdicts = judged(study)
    assert verdicts["D03"].ours["trials"] == judged(made_up())["D03"].ours["trials"] - 1
    json.dumps(finite([verdict.record() for verdict in verdicts.values()]), allow_nan=False)
    assert isinstance(verdicts["D01"], Verdict)


def choice(q, costs=(1.0, 1.0, 1.0)):
    return cameras.Choice(np.array(q), np.array([3.0, 2.0, 1.0]), np.array(costs))


SEES_MOST_FIRST = [[1.0, 1.0, 1.0, 0.0], [0.0, 0.0, 0.9, 0.0], [0.0, 0.0, 0.0, 0.5]]
SCORES = {(0,): 0.7, (1,): 0.4, (2,): 0.4, (0, 1): 0.7, (0, 2): 0.9, (1, 2): 0.5, (0, 1, 2): 0.92}


def test_each_program_is_worth_what_its_cameras_gave():
    one, two = (cameras.chosen(choice(SEES_MOST_FIRST), SCORES, m) for m in (1, 2))
    assert one == pytest.approx(
        {
            "greedy": 0.7,
            "greedy by sight": 0.7,
            "greedy by bytes": 0.7,
            "nearest": 0.4,
            "random": 0.5,
            "best": 0.7,
        }
    )
    assert two == pytest.approx(
        {
            "greedy": 0.9,
            "greedy by sight": 0.9,
            "greedy by bytes": 0.9,
            "nearest": 0.5,
            "random": 0.7,
            "best": 0.9,
        }
    )


def test_a_budget_of_bytes_leaves_a_dear_camera_out():
    dear = cameras.chosen(choice(SEES_MOST_FIRST, (10.0, 1.0, 1.0)), SCORES, 1)
    assert (dear["greedy"], dear["greedy by bytes"]) == (0.7, 0.5)


def test_d08_holds_only_if_the_choice_is_better_than_chance():
    found = {rig: (choice(SEES_MOST_FIRST), SCORES) for rig in RIG_LEVELS}
    good = cameras.judge(found)
    assert good.reproduced
    assert good.ours["greedy_is_best"] == good.ours["choices"] == 2 * len(RIG_LEVELS)
    worse = SCORES | {(0,): 0.1, (0, 2): 0.1}
    assert not cameras.judge({rig: (choice(SEES_MOST_FIRST), worse) for rig in RIG_LEVELS}).reproduced


def some_pieces(worth):
    alone = np.linspace(0.0, 0.9, 16)
    return [
        pieces.Pieces("r", node, worth(alone), worth(alone), alone, np.full(16, 0.1)) for node in range(3)
    ]


def test_d07_follows_how_worth_and_sight_go_together():
    up, down = some_pieces(lambda alone: 2.0 * alone), some_pieces(lambda alone: 1.0 - alone)
    assert pieces.judge(up).reproduced
    assert pieces.judge(up).ours["rank_correlation_worth_alone"] == pytest.approx(1.0)
    assert not pieces.judge(down).reproduced
    found = pieces.judge(up).ours
    assert found["points_per_joule_all"] == pytest.approx(2.0 * 0.45 / 0.1)
    assert found["points_per_joule_best_quarter"] > found["points_per_joule_all"]


def test_the_page_states_the_exchange_rate():
    verdicts = judged(made_up())
    found = {rig: (choice(SEES_MOST_FIRST), SCORES) for rig in RIG_LEVELS}
    verdicts["D08"] = cameras.D08.judge(found)
    verdicts["D07"] = pieces.D07.judge(some_pieces(lambda alone: alone))
    numbers = {}
    for name, verdict in verdicts.items():
        record = finite(verdict.record())
        numbers[name] = record | {"tables": [e for e in record["exhibits"] if "header" in e]}
    record = Record("delivery_claims", "packetmesh", "abc1234", "2026-01-01", {}, "2 cores", rounded(numbers))
    page = results_page({record.name: record})
    assert "0.300 [0.300, 0.300] points raw" in page
    assert "0.100 [0.100, 0.100] points layered" in page
    for title in (
        "One per cent of lost packets",
        "What is left after losses",
        "F-score of some of the cameras",
    ):
        assert f"**{title}**" in page
