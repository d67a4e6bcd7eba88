// A notice if the server refuses this page's websocket: the browser does not tell why, and viser's page only
// shows "Connecting..." (origin.py).
(() => {
  const asked = new URL("why-refused", document.baseURI);
  asked.searchParams.set("origin", location.origin);
  fetch(asked).then(async answer => {
    const plain = answer.headers.get("Content-Type")?.startsWith("text/plain"); // a proxy may answer with a page
    const sentence = answer.ok && plain ? (await answer.text()).trim() : "";
    if (!sentence) return;
    const notice = document.createElement("div");
    notice.className = "packetmesh-refused";
    notice.role = "alert";
    notice.textContent = sentence;
    document.body.append(notice);
  }).catch(() => {}); // the server is gone: viser connects again when it is back
})();
