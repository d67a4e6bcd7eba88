// Plotly takes a third of the time in which the page starts, and few visits see a plot: the page loads it when
// the first plot is drawn. Its script replaces this window.Plotly, which keeps the plots until then.
(() => {
  const waiting = new Map(); // what to draw in each element
  let loading = false;

  function load() {
    loading = true;
    const src = document.querySelector("meta[name=packetmesh-plotly]").content;
    const script = Object.assign(document.createElement("script"), {src});
    script.addEventListener("load", () => {
      for (const [plot, figure] of waiting) window.Plotly.react(plot, ...figure);
    });
    document.head.append(script);
  }

  window.Plotly = {
    react(plot, ...figure) {
      waiting.set(plot, figure);
      if (!loading) load();
    },
    purge(plot) {
      waiting.delete(plot);
    },
  };
})();
