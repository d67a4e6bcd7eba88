"""docs/results.md and the results in README.md, written from the records alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from lab.benchmarks.filling import FLAT, NETWORK, OURS, PIXELS
from lab.claims.claim import VERDICTS, is_beyond
from lab.claims.registry import CLAIMS
from lab.results import completion, tables
from lab.results.markdown import Row, change, listed
from lab.results.record import ROOT, Record, Records, read_records
from packetmesh.files import atomic_path

RESULTS = ROOT / "docs" / "results.md"
README = ROOT / "README.md"
DEPTH_README = ROOT / "assets" / "depth" / "README.md"
WORTH = ROOT / "assets" / "depth" / "worth.md"
"""What the Depth screen says of filling."""
BEGIN, END = "<!-- results: written by `make results` -->", "<!-- end of results -->"
"""Around the lines of a page that state results."""

SECTIONS: dict[str, tuple[str, Callable[[Row], str]]] = {
    "reconstruct": ("What comes out", tables.reconstructions),
    "real_frames": ("What real frames keep", tables.real_frames),
    "bench_chain": ("Time and memory of the whole chain", tables.chain_speed),
    "calibration_claims": ("Calibration: the thesis's claims", tables.claims),
    "board_claims": ("Boxes and biased sensors: what a calibration is worth", tables.claims),
    "outlier_claims": ("Outlier filter: the thesis's claim", tables.claims),
    "depth_claims": ("Inferred depth: the thesis's claims", completion.depth_claims),
    "bench_depth": ("Filling holes", completion.filling),
    "fill_claims": ("Filling holes: how far its confidence can be trusted", completion.fill_claims),
    "registration_claims": ("Registration: the thesis's claims", tables.registration_claims),
    "bench_registration": ("Registration: speed", tables.registration_speed),
    "bench_problems": ("Registration: problems in the form of a public benchmark", tables.problems),
    "surface_claims": ("Ball pivoting: the thesis's claims", tables.claims),
    "bench_surface": ("Ball pivoting: speed", tables.rolling_speed),
    "network_claims": ("The camera network: the thesis's claims", tables.claims),
    "bench_network": ("The camera network: speed", tables.network_speed),
    "delivery_claims": ("What a lost packet costs: ours, beyond the thesis", tables.our_claims),
    "setting_claims": ("Settings, and what cannot be tested", tables.claims),
    "ns3_saturation": ("The camera network: throughput beside ns-3", tables.ns3_throughput),
}
"""Heading and body by record, in the order of the page; a section without its record is left out."""

NETWORK_FILLERS = (OURS, NETWORK, FLAT, PIXELS)
"""What fills by the network, or by its alignment."""

INTRODUCTION = """# Results

Written by `make results` from the records in [docs/results](results): edit neither this page nor its numbers.
`make results-record ONLY=NAME` measures again. A record also holds the versions of the libraries. Shares of
claims run from 0 to 1, intervals are 95 %."""


def write_pages() -> None:
    """Write all pages from the committed records."""
    records = read_records()
    pages = {
        RESULTS: results_page(records),
        README: readme(README.read_text("utf-8"), records),
        DEPTH_README: marked(DEPTH_README.read_text("utf-8"), worth(records)),
        WORTH: f"{worth(records)}\n",
    }
    for path, content in pages.items():
        with atomic_path(path) as temporary:
            temporary.write_text(content, "utf-8")


def results_page(records: Records) -> str:
    """The whole of docs/results.md."""
    parts = [INTRODUCTION]
    for name, (heading, body) in SECTIONS.items():
        if name in records:
            parts += [f"## {heading}", _origin(records[name]), body(records[name].numbers)]
    return "\n\n".join(parts) + "\n"


def _origin(record: Record) -> str:
    return (
        f"[`{record.command}`](results/{record.name}.json), commit {record.commit}, {record.date}, "
        f"{record.machine}"
    )


def readme(page: str, records: Records) -> str:
    """The README with the lines between its marks replaced."""
    return marked(page, "\n".join(f"- {line}" for line in readme_results(records)))


def worth(records: Records) -> str:
    """What completion is worth, for the networks' README and the Depth screen."""
    return "\n\n".join(completion.standing(records))


def marked(page: str, lines: str) -> str:
    """A page with other lines between its marks."""
    pattern = f"({re.escape(BEGIN)}\n).*?({re.escape(END)})"
    return re.sub(pattern, lambda marks: f"{marks[1]}{lines}\n{marks[2]}", page, flags=re.DOTALL)


def readme_results(records: Records) -> Iterator[str]:
    """What the README says of results, a sentence or two for each record it needs."""
    if "reconstruct" in records:
        yield _fusion(records["reconstruct"].numbers)
    if "registration_claims" in records:
        yield _registration(records["registration_claims"].numbers)
    if "depth_claims" in records:
        yield _depth(records["depth_claims"].numbers["C12"]["ours"])
    if "bench_depth" in records:
        yield _filling(records["bench_depth"].numbers["depth"]["runs"])
    if "delivery_claims" in records:
        yield _exchange(records["delivery_claims"].numbers)
    claims = {
        name: claim
        for key, record in records.items()
        if key.endswith("_claims")
        for name, claim in record.numbers.items()
        if not is_beyond(name)
    }
    if claims:
        yield _unreproduced(claims)


def _fusion(numbers: Row) -> str:
    scene, presets = next(iter(numbers.items()))
    parts = []
    for preset, run in presets.items():
        before, after = run["surface_before"], run["surface_after"]
        rays = change(before["no_hit_ray_share"], after["no_hit_ray_share"])
        scores = change(*tables.f_scores(run) or (None, None))
        parts.append(f"by `{preset}` {rays} and {scores}")
    return (
        "**What fills a hole is a guess.** Rays without a surface, and F-score at 5 cm, before → after "
        f"fusion in {scene}: {'; '.join(parts)}."
    )


def _registration(numbers: Row) -> str:
    medians = tables.point_errors(numbers)
    biased = [float(cells["bias 3 %"].split()[0]) for cells in medians.values() if "bias 3 %" in cells]
    lost, gated = (tables.losses(medians, rival) for rival in ("icp", "icp-gated"))
    return (
        f"**CEICP does not always win.** Plain ICP ends nearer to the truth in {len(lost)} of "
        f"{len(medians['icp'])} conditions: {'; '.join(lost)}. ICP with a gate does in {len(gated)} of "
        f"{len(medians['icp-gated'])}. No rigid method repairs a depth bias: 3 % leaves {min(biased):.1f} to "
        f"{max(biased):.1f} cm."
    )


def _depth(ours: dict[str, float]) -> str:
    scaled, raw = (
        {key.removeprefix(prefix): value for key, value in ours.items() if key.startswith(prefix)}
        for prefix in ("abs_rel_median-scaled_", "abs_rel_raw_")
    )
    held_out = [value for name, value in scaled.items() if name.startswith("Scene ")]
    real = [name for name in scaled if name.startswith("kinect")]
    return (
        "**The depth network saw rendered rooms only.** Scaled by the median, its mean relative error is "
        f"{min(held_out):.3f} to {max(held_out):.3f} in rooms that it never saw; on real frames "
        + listed([f"{scaled[name]:.3f} (as it comes {raw[name]:.2f}) on {name}" for name in real])
        + ". A sensor has to align it."
    )


def _filling(runs: list[Row]) -> str:
    """Ours beside the flat guess and the best that needs no network, by group of images."""
    parts = []
    for group in dict.fromkeys(run["group"] for run in runs if run.get("group", "").endswith(", hidden")):
        errors = {run["program"]: run for run in runs if run.get("group") == group}
        peers = [run for name, run in errors.items() if name not in NETWORK_FILLERS]
        best = min(peers, key=lambda run: run["abs_rel"])
        shown = (
            ("completion", errors[OURS]),
            (NETWORK, errors[NETWORK]),
            ("a flat guess", errors[FLAT]),
            (best["program"], best),
        )
        cells = ", ".join(f"{name} {tables.error(run)}" for name, run in shown)
        parts.append(f"{group.removesuffix(', hidden')}: {cells}")
    return (
        "**What fills holes.** Relative error over all hidden pixels by completion, by the colour network "
        "alone, by one depth everywhere through the same alignment, and by the best of the rest: "
        f"{'; '.join(parts)}."
    )


def _exchange(numbers: Row) -> str:
    """The headline of the experiment with losses."""
    rates, aim = numbers["D01"], numbers["D02"]

    def rate(coding: str) -> str:
        name = f"points_per_percent_{coding}_fused"
        low, high = rates["ci95"][name]
        return f"{rates['ours'][name]:.3f} [{low:.3f}, {high:.3f}]"

    kept, ratio = aim["ours"]["kept_layered"], aim["ours"]["bytes_over_jpeg"]
    sure = "" if rates["verdict"] == "holds" else "; which of them costs least is not certain"
    return (
        f"**What a lost packet costs.** One per cent of lost packets costs {rate('raw')} points of F-score "
        f"at 5 cm with raster, {rate('tiles')} with tiles, {rate('layered')} layered (95 % over seeds and "
        f"rigs){sure}. At 10 % burst loss the layered coding keeps {100.0 * kept:.1f} % of the lossless "
        f"F-score at {ratio:.2f} times the bytes of JPEG with RVL."
    )


def _unreproduced(claims: Row) -> str:
    by_verdict: dict[str, list[str]] = {word: [] for word in VERDICTS}
    for name in sorted(claims):
        by_verdict[claims[name]["verdict"]].append(name)
    reproduced, missing, defined, untested = (by_verdict[word] for word in VERDICTS[:4])
    everyone = {name for name in CLAIMS if not is_beyond(name)}
    waiting = sorted(everyone - set(claims))
    sentence = (
        f"**The thesis's claims.** Of {len(everyone)}, {len(claims)} are on record: {len(reproduced)} "
        f"reproduced, {len(defined)} true by definition, {len(untested)} that nothing here can test; not "
        f"reproduced: {listed(missing)}. [Why](docs/results.md)."
    )
    return sentence + (f" Not measured since the last change: {listed(waiting)}." if waiting else "")
