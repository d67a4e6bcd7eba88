// Plotly takes a third of the time in which the page starts, more bytes than the rest of the page, and few visits
// see a plot: the page loads it when the first plot comes into view. Its script replaces this window.Plotly, which
// keeps the plots until then.
(() => {
  const STAY_MS = 300; // time for which a plot is in view before the page loads Plotly
  const waiting = new Map(); // what to draw in each element
  const inView = new Set();
  let loading = false;

  const seen = new IntersectionObserver(changes => {
    for (const {target, isIntersecting} of changes) inView[isIntersecting ? "add" : "delete"](target);
    setTimeout(() => {
      if (!loading && [...inView].some(plot => plot.isConnected)) load();
    }, STAY_MS);
  });

  function load() {
    loading = true;
    const src = document.querySelector("meta[name=packetmesh-plotly]").content;
    const script = Object.assign(document.createElement("script"), {src});
    script.addEventListener("load", () => {
      seen.disconnect();
      for (const [plot, figure] of waiting) window.Plotly.react(plot, ...figure);
    });
    document.head.append(script);
  }

  window.Plotly = {
    react(plot, ...figure) {
      waiting.set(plot, figure);
      seen.observe(plot);
    },
    purge(plot) {
      waiting.delete(plot);
      inView.delete(plot);
      seen.unobserve(plot);
    },
  };
})();
