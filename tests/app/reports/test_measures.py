"""What a report says of the measures on the surface."""

from app.reports.measures import measured_sections, measured_sentence
from app.web.markup import Markup


def value(name, length_m, half_m, guessed=False):
    interval_m = [length_m - half_m, length_m + half_m]
    return {"name": name, "value": length_m, "unit": "m", "ci95": interval_m, "guessed": guessed}


def measures(*listed, scaled_by=None):
    named = [
        {"name": name, "kind": "box", "trouble": "" if values else "no corner", "values": values}
        for name, values in listed
    ]
    return {"measures": named, "scale": "that of the cameras", "scaled_by": scaled_by}


SHELF = [value("width", 0.8, 0.01), value("depth", 0.301, 0.003), value("height", 1.9, 0.02, guessed=True)]


def test_every_number_of_the_sentence_has_its_interval_also_the_sides_of_a_box():
    listed = measures(("door", [value("length", 2.01, 0.01)]), ("shelf", SHELF), ("lamp", []))
    assert measured_sentence(listed) == (
        "Measured, with 95 % intervals: door 2.010 ± 0.010 m; "
        "shelf width 80.0 ± 1.0 cm, depth 30.1 ± 0.3 cm, height 1.90 ± 0.02 m (guessed)."
    )
    assert measured_sentence(measures(("lamp", []))) == ""


def test_a_true_length_that_scales_is_named_with_its_factor():
    told = Markup("").join(measured_sections(measures(("shelf", SHELF), scaled_by=1.0312)))
    assert "One length was entered; all others are multiplied by 1.0312 because of it." in told
    assert "multiplied" not in Markup("").join(measured_sections(measures(("shelf", SHELF))))
