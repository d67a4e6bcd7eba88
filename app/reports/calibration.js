// Draws the page's figures, each at its place.

for (const [row, {data, layout}] of JSON.parse(document.getElementById("figures").textContent).entries())
  Plotly.newPlot(`figure-${row}`, data, layout, {displayModeBar: false, responsive: true});
