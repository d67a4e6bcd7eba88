"""Tables of exchange rates, sending and losses, and the chart of the F-score over losses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lab.claims.delivery.network import NETWORKS, SendTask
from lab.claims.delivery.setup import CODINGS, HEADLINE, LARGE, RATE_SHARE, SMALL, lossless
from lab.claims.delivery.statistics import estimate, mean_terms
from lab.claims.delivery.study import Study
from lab.claims.delivery.trials import BURST_PACKETS, LossTask
from lab.claims.exhibits import Chart, Curve, Table
from pipeline.delivery import CODINGS as ALL_CODINGS

WHEN = {"before": "sensor only", "after": "fused"}


def title(coding: str) -> str:
    """Return a coding's title."""
    return ALL_CODINGS[coding].title


def ranged(value: float, ci95: tuple[float, float], digits: int = 3) -> str:
    """Return a value with its interval as text."""
    return f"{value:.{digits}f} [{ci95[0]:.{digits}f}, {ci95[1]:.{digits}f}]"


def rate_table(study: Study) -> Table:
    """Return the costs of one per cent of lost packets, and of sending one per cent of the packets."""
    rows = []
    for coding in CODINGS:
        cells = [ranged(*estimate(study.rate_terms(coding, when))) for when in WHEN]
        rows.append((title(coding), *cells, *_sending_cells(study, coding)))
    sent_rig = next(iter(study.sent)).rig
    return Table(
        "One per cent of lost packets",
        (
            *("coding", *(f"costs points, {words}" for words in WHEN.values())),
            *(
                f"{name}, {mac}"
                for mac in NETWORKS.values()
                for name in ("kB", "s", "J radios", "J platforms")
            ),
        ),
        tuple(rows),
        "Points of F-score at 5 cm, of 100, for one per cent of all nodes' packets lost in bursts of "
        f"{BURST_PACKETS:.0f} in the mean: slope up to {RATE_SHARE:.0%}, mean over {len(study.rigs)} rigs, "
        "interval by resampling rigs and seeds. Below 0 losses helped, by chance. PNG, JPEG and RVL files do "
        "not fall along a line: with the first lost packet a node's image is gone. The other columns are "
        f"the cost of sending one per cent of the packets, from a run in which {sent_rig} is sent until "
        "everything has arrived: bytes of the images, seconds, and joules of the nodes' radios and of "
        "their computers.",
    )


def _sending_cells(study: Study, coding: str) -> list[float | None]:
    rig = next(iter(study.sent)).rig
    cells: list[float | None] = []
    for network in NETWORKS:
        values = study.sent[SendTask(rig, coding, network)]
        cells += [
            None if (value := values.get(name)) is None else factor * value
            for name, factor in (("bytes", 1e-5), ("seconds", 0.01), ("radio_j", 0.01), ("platform_j", 0.01))
        ]
    return cells


def sending_table(study: Study) -> Table:
    """Return bytes, packets, time and energy until everything has arrived, by coding and network."""
    rows = tuple(
        (
            *(title(task.coding), NETWORKS[task.network]),
            *(values.get(name) for name in ("bytes", "packets", "air_bytes", "attempts_lost", "seconds")),
            *(values.get(name) for name in ("radio_j", "platform_j")),
        )
        for task, values in study.sent.items()
    )
    rig = next(iter(study.sent)).rig
    return Table(
        f"Until everything has arrived: {rig}",
        (
            *("coding", "medium access", "bytes of images", "packets", "bytes on the air", "failed attempts"),
            *("seconds", "J, radios", "J, platforms"),
        ),
        rows,
        "One run each; lost frames are sent again. Energy of the camera nodes until the last packet arrived. "
        "A dash: not everything arrived within four hours.",
    )


MEASURES = (
    ("F-score, sensor only", "f_before", 100.0),
    ("F-score, fused", "f_after", 100.0),
    ("rays without a surface, sensor only", "no_hit_before", 100.0),
    ("rays without a surface, fused", "no_hit_after", 100.0),
    ("hole area, m², fused", "hole_area_m2_after", 1.0),
    ("median depth error, mm, fused", "median_depth_error_m_after", 1000.0),
)


def losses_table(study: Study) -> Table:
    """Return means over rigs and seeds by coding, packet size, kind and share of losses."""
    groups: dict[tuple[str, int, str, float], list[LossTask]] = {}
    for task in study.losses:
        if task.alignment == "local":
            key = (task.coding, task.packet_bytes, task.loss if task.share else "none", task.share)
            groups.setdefault(key, []).append(task)
    rows = []
    for (coding, packet_bytes, loss, share), tasks in sorted(
        groups.items(), key=lambda item: _order(item[0])
    ):
        delivered = np.mean([study.value(t, "bytes_delivered") for t in tasks]) / 1e3
        lost = np.mean([study.lost_percent(task) for task in tasks])
        measures = [_mean(study, tasks, name, factor) for _, name, factor in MEASURES]
        rows.append(
            (
                *(title(coding), packet_bytes, loss, f"{100 * share:g} %", len(tasks)),
                *(float(lost), float(delivered), *measures),
            )
        )
    return Table(
        "What is left after losses",
        (
            *("coding", "bytes a packet", "losses", "configured loss", "trials", "lost, %", "kB delivered"),
            *(name for name, _, _ in MEASURES),
        ),
        tuple(rows),
        "Means over rigs and seeds; shares and F-scores in per cent. A trial in which nothing can be rebuilt "
        "has an F-score of 0 and no hit; holes and depth errors are of those with a surface. The raw coding "
        "without losses stands for all lossless codings, which give the same images.",
    )


def _order(key: tuple[str, int, str, float]) -> tuple[int, int, str, float]:
    coding, packet_bytes, loss, share = key
    return CODINGS.index(coding), -packet_bytes, "" if loss == "none" else loss, share


def _mean(study: Study, tasks: Sequence[LossTask], name: str, factor: float) -> float | None:
    """Return ``factor`` times the mean over the trials that have the value; None if none has it."""
    values = np.array([study.value(task, name) for task in tasks])
    return factor * float(np.nanmean(values)) if np.isfinite(values).any() else None


def loss_chart(study: Study) -> Chart:
    """Return a chart of the F-score over the configured loss share, in bursts."""
    curves = []
    for coding in HEADLINE:
        for when, words in WHEN.items():
            name = f"f_{when}"
            points = [(0.0, [[study.value(lossless(rig, coding), name)] for rig in study.rigs])]
            for share in sorted({task.share for task in study.tasks(coding)}):
                tasks = [task for task in study.tasks(coding) if task.share == share]
                by_rig = [[study.value(t, name) for t in tasks if t.rig == rig] for rig in study.rigs]
                points.append((share, by_rig))
            estimates = [estimate([mean_terms(100.0 * f for f in rig) for rig in by]) for _, by in points]
            curves.append(
                Curve(
                    f"{title(coding)}, {words}",
                    tuple(100.0 * share for share, _ in points),
                    tuple(value for value, _ in estimates),
                    tuple(low for _, (low, _) in estimates),
                    tuple(high for _, (_, high) in estimates),
                )
            )
    return Chart(
        "F-score at 5 cm over lost packets",
        "packets lost in bursts, %",
        "F-score, %",
        tuple(curves),
        note="Bands: 95 % over rigs and seeds, most of it how rigs differ; the exchange rate compares each "
        f"rig with itself. Packets of {LARGE} bytes; the table also has {SMALL}, where they were run.",
    )
