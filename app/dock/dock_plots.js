// Plots in a row in the dock, with a table next to them. The server's part is plots.py.
(() => {
  const rows = new Map();
  const {DockRow, make} = window.packetmeshDockRow;

  class PlotRow extends DockRow {
    constructor(name) {
      super(name, "Plots");
      this.row.classList.add("plots");
      this.figures = [];
      const bar = make("div", "bar", this.row);
      this.title = make("b", "", bar);
      this.legend = make("span", "legend", bar);
      const close = make("button", "", bar, {textContent: "✕", title: "Close", type: "button"});
      close.addEventListener("click", () => {
        this.closed = this.run;
        this.wanted = false;
        this.place();
      });
      this.body = make("div", "plots", this.row);
      this.table = make("div", "table", this.body);
      new ResizeObserver(() => this.draw()).observe(this.body);
    }

    // A row that was closed stays closed until a new run is shown.
    hear({visible, run, title, legend, figures, table}) {
      this.run = run;
      this.wanted = visible && run !== this.closed;
      if (visible) {
        this.title.textContent = title;
        this.legend.innerHTML = legend;
        this.table.innerHTML = table;
        this.figures = figures;
      }
      this.place();
      this.draw();
    }

    draw() {
      if (!this.visible) return;
      this.figures.forEach(({data, layout}, index) => {
        const plot = this.body.querySelectorAll(".plot")[index] ?? make("div", "plot", null);
        if (!plot.isConnected) this.table.before(plot);
        const size = {width: plot.clientWidth, height: plot.clientHeight};
        window.Plotly.react(plot, data, {...layout, ...size}, {displayModeBar: false});
      });
    }
  }

  packetmesh.calls.plots = (_, message) => {
    if (!rows.has(message.dock)) rows.set(message.dock, new PlotRow(message.dock));
    rows.get(message.dock).hear(message);
  };
})();
