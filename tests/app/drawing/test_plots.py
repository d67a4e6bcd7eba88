"""The common style of plots."""

import json

import plotly.graph_objects as go

from app.drawing.plots import styled_figure, titled_figure


def test_a_plot_is_written_as_plotly_writes_it_with_that_style():
    figure = styled_figure(xaxis={"title": "radius, mm"}, bargap=0)
    figure.add_bar(x=[1.0, 2.0], y=[3, 4])
    figure.update_layout(yaxis2={"domain": [0.6, 1.0]})
    own = go.Figure(layout={"template": "plotly_white", "xaxis": {"title": "radius, mm"}, "bargap": 0})
    own.add_bar(x=[1.0, 2.0], y=[3, 4])
    own.update_layout(yaxis2={"domain": [0.6, 1.0]})
    assert json.loads(figure.to_json()) == json.loads(own.to_json())


def test_two_plots_share_no_settings():
    titled_figure("one", "x", "y").update_layout(template={"layout": {"bargap": 1.0}})
    other = titled_figure("two", "x", "y").to_dict()
    assert other["layout"]["title"]["text"] == "two"
    assert "bargap" not in other["layout"]["template"]["layout"]
