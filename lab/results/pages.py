"""docs/results.md and the results in README.md, written from the records alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from lab.benchmarks.filling import FLAT, OURS
from lab.claims.claim import VERDICTS, is_beyond
from lab.claims.registry import CLAIMS
from lab.results import (
    between_cameras,
    codings,
    completion,
    measuring,
    places,
    planning,
    recordings,
    tables,
    tile_worth,
    verdicts,
)
from lab.results.markdown import Row, listed, percent
from lab.results.record import ROOT, Record, Records, read_records
from lab.walks.ours import OURS as WALKER
from lab.walks.path import RATE_HZ
from packetmesh.files import atomic_path

RESULTS = ROOT / "docs" / "results.md"
README = ROOT / "README.md"
DEPTH_README = ROOT / "assets" / "depth" / "README.md"
WORTH = ROOT / "assets" / "depth" / "worth.md"
"""The text on filling in the Depth screen."""
BEGIN, END = "<!-- results: written by `make results` -->", "<!-- end of results -->"
"""Marks around the results in a page."""

PLACES, RECORDINGS = "bench_places", "bench_recording"
PICTURES: dict[str, Callable[[Row], dict[str, str]]] = {
    PLACES: places.pictures,
    RECORDINGS: recordings.pictures,
    "planning": planning.pictures,
}
"""Function that draws a record's pictures, by record; they are written next to the page."""

SECTIONS: dict[str, tuple[str, Callable[[Row], str]]] = {
    "reconstruct": ("What comes out", tables.reconstructions),
    "real_frames": ("What real frames keep", tables.real_frames),
    "bench_chain": ("Time and memory of the whole chain", tables.chain_speed),
    "calibration_claims": ("Calibration: the thesis's claims", tables.claims),
    "calibration_verdicts": ("Calibration: how often the verdict is right", verdicts.calibration_verdicts),
    "board_claims": ("Boxes and biased sensors: what a calibration is worth", tables.claims),
    "outlier_claims": ("Outlier filter: the thesis's claim", tables.claims),
    "depth_claims": ("Inferred depth: the thesis's claims", completion.depth_claims),
    "bench_depth": ("Filling holes", completion.filling),
    "fill_claims": ("Filling holes: how far its confidence can be trusted", completion.fill_claims),
    "registration_claims": ("Registration: the thesis's claims", tables.registration_claims),
    "bench_registration": ("Registration: speed", tables.registration_speed),
    "bench_problems": ("Registration: problems in the form of a public benchmark", tables.problems),
    PLACES: ("Registration: views placed without a start", places.places),
    RECORDINGS: ("Recordings: a camera that walks", recordings.recordings),
    "surface_claims": ("Ball pivoting: the thesis's claims", tables.claims),
    "bench_surface": ("Ball pivoting: speed", tables.rolling_speed),
    "bench_measuring": ("Measuring on the surface", measuring.measuring),
    "planning": ("Where the next camera stands", planning.planning),
    "network_claims": ("The camera network: the thesis's claims", tables.claims),
    "bench_network": ("The camera network: speed", tables.network_speed),
    "delivery_claims": ("What a lost packet costs: ours, beyond the thesis", tables.our_claims),
    "bench_codings": ("Bytes of a camera's images", codings.codings),
    "between_cameras": ("Tiles that another camera shows", between_cameras.between_cameras),
    "tile_worth": ("The order of tiles that the sink requests", tile_worth.tile_worth),
    "setting_claims": ("Settings, and what cannot be tested", tables.claims),
    "ns3_saturation": ("The camera network: throughput beside ns-3", tables.ns3_throughput),
}
"""Heading and body by record, in the order of the page; a section without its record is left out."""


INTRODUCTION = """# Results

Written by `make results` from the records in [docs/results](results): edit neither this page nor its numbers.
`make results-record ONLY=NAME` measures again. A record also holds the versions of the libraries. Shares of
claims run from 0 to 1 unless per cent or points of 100 are named, intervals are 95 %."""


def write_pages() -> None:
    """Write all pages and pictures from the records in docs/results."""
    records = read_records()
    pages = {
        RESULTS: results_page(records),
        README: readme(README.read_text("utf-8"), records),
        DEPTH_README: marked(DEPTH_README.read_text("utf-8"), worth(records)),
        WORTH: f"{worth(records)}\n",
    }
    for record, pictures in PICTURES.items():
        if record in records:
            found = pictures(records[record].numbers)
            pages |= {RESULTS.parent / name: text for name, text in found.items()}
    for path, content in pages.items():
        with atomic_path(path) as temporary:
            temporary.write_text(content, "utf-8")


def results_page(records: Records) -> str:
    """Return the whole of docs/results.md."""
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
    """Return the README with the lines between its marks replaced."""
    return marked(page, "\n".join(f"- {line}" for line in readme_results(records)))


def worth(records: Records) -> str:
    """Return the text on the benefit of completion, for the networks' README and the Depth screen."""
    return "\n\n".join(completion.standing(records))


def marked(page: str, lines: str) -> str:
    """Return a page with ``lines`` in place of what is between its marks; without marks it is unchanged."""
    pattern = f"({re.escape(BEGIN)}\n).*?({re.escape(END)})"
    return re.sub(pattern, lambda marks: f"{marks[1]}{lines}\n{marks[2]}", page, flags=re.DOTALL)


def readme_results(records: Records) -> Iterator[str]:
    """Yield the README's limits: a line for each record that it needs, and one for all records of claims."""
    if "reconstruct" in records:
        yield _fusion(records["reconstruct"].numbers)
    if "registration_claims" in records:
        yield _registration(records["registration_claims"].numbers)
    if PLACES in records:
        yield _places(records[PLACES].numbers)
    if RECORDINGS in records:
        yield _walks(records[RECORDINGS].numbers)
    if "depth_claims" in records:
        yield _depth(records["depth_claims"].numbers["C12"]["ours"])
    if "bench_depth" in records:
        yield _filling(records["bench_depth"].numbers["depth"]["runs"])
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
    scores = [found for presets in numbers.values() if (found := tables.f_scores(presets["packetmesh"]))]
    falls = sum(after < before for before, after in scores)
    return (
        "**What fills a hole is a guess.** Fewer rays are without a surface after fusion, but its F-score "
        f"falls in {falls} of {len(scores)} scenes ({_link('all scenes', 'what-comes-out')})."
    )


def _registration(numbers: Row) -> str:
    medians = tables.point_errors(numbers)
    lost, conditions = len(tables.losses(medians, "icp")), len(medians["icp"])
    return (
        f"**CEICP does not always win.** Plain ICP ends nearer to the truth in {lost} of {conditions} "
        f"conditions ({_link('which', 'registration-the-thesiss-claims')})."
    )


def _walks(numbers: Row) -> str:
    run = next(run for run in numbers[recordings.EVERY]["runs"] if run["program"] == WALKER)
    longer = run["frames_s"] < RATE_HZ
    return (
        f"**A walk takes {'longer' if longer else 'no longer'} than it lasted.** One core follows and maps "
        f"{run['frames_s']:.0f} frames of 320 x 240 a second, and the camera takes {RATE_HZ:.0f} "
        f"({_link('other programs', 'recordings-a-camera-that-walks')})."
    )


def _places(numbers: Row) -> str:
    """Compare the pairs with the least and the largest overlap."""
    runs = [run for run in numbers[places.BY_OVERLAP]["runs"] if run["program"] == places.OURS]
    least, most = (fold(runs, key=lambda run: run["overlap"]) for fold in (min, max))
    found = {run["overlap"]: f"{percent(run['right'] / run['pairs'], 0)}" for run in (least, most)}
    return (
        "**Two views that share little seldom find each other.** Without a start, "
        f"{found[least['overlap']]} of the pairs that share {percent(least['overlap'], 0)} are placed, and "
        f"{found[most['overlap']]} of those that share {percent(most['overlap'], 0)} "
        f"({_link('other programs', 'registration-views-placed-without-a-start')})."
    )


def _depth(ours: dict[str, float]) -> str:
    prefix = "abs_rel_median-scaled_kinect"
    worst = max(value for key, value in ours.items() if key.startswith(prefix))
    return (
        "**The depth network learned from rendered rooms.** On real frames its relative error is up to "
        f"{worst:.3f}, even scaled by the median ({_link('all sets', 'inferred-depth-the-thesiss-claims')})."
    )


def _filling(runs: list[Row]) -> str:
    """Compare our completion with one depth everywhere, in the first group of images with hidden depth."""
    group = next(run["group"] for run in runs if run.get("group", "").endswith(", hidden"))
    errors = {run["program"]: run["abs_rel"] for run in runs if run.get("group") == group}
    ratio = errors[OURS] / errors[FLAT]
    return (
        f"**Completion {'beats' if ratio < 1.0 else 'does not beat'} a flat guess.** Its error in hidden "
        f"holes of {group.removesuffix(', hidden')} is {ratio:.2f} times that of one depth everywhere "
        f"({_link('all programs', 'filling-holes')})."
    )


def _unreproduced(claims: Row) -> str:
    missing = [name for name, claim in claims.items() if claim["verdict"] == VERDICTS[1]]
    everyone = {name for name in CLAIMS if not is_beyond(name)}
    waiting = sorted(everyone - set(claims))
    sentence = (
        f"**Not every claim of the thesis reproduces.** {len(missing)} of {len(everyone)} do not "
        "([which, and why](docs/results.md))."
    )
    return sentence + (f" Not measured since the last change: {listed(waiting)}." if waiting else "")


def _link(text: str, heading: str) -> str:
    return f"[{text}](docs/results.md#{heading})"
