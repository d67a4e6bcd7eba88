// A notice if this page gets no websocket: the browser does not tell why, and viser's page only shows
// "Connecting..." (origin.py).
(() => {
  const waitMs = 10000;
  const ask = async waited => {
    const asked = new URL("why-refused", document.baseURI);
    asked.searchParams.set("origin", location.origin);
    if (waited) asked.searchParams.set("waited", "1");
    const answer = await fetch(asked);
    const plain = answer.headers.get("Content-Type")?.startsWith("text/plain"); // a proxy may answer with a page
    const sentence = answer.ok && plain ? (await answer.text()).trim() : "";
    if (!sentence || document.querySelector(".packetmesh-refused")) return;
    const notice = document.createElement("div");
    notice.className = "packetmesh-refused";
    notice.role = "alert";
    notice.textContent = sentence;
    document.body.append(notice);
  };
  const gone = () => {}; // the server is gone: viser connects again when it is back
  ask(false).catch(gone);
  setTimeout(() => {
    if (document.body.innerText.includes("Connecting...")) ask(true).catch(gone);
  }, waitMs);
})();
