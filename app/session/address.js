// The page's address shows the app's state, and a changed address changes the state. The state is in the
// query, next to viser's own keys: viser cannot connect from an address that contains a #.
window.packetmeshAddress = (() => {
  let name = null; // name of the session's hidden field
  let keys = []; // the app's keys in the query
  let start = new URLSearchParams(); // the query of the session's start
  let said = 0;
  let unsaid = null; // query that the server has not received yet
  let again = 0; // timer of the next attempt to send it

  function split() {
    const own = new URLSearchParams(), others = new URLSearchParams();
    for (const [key, value] of new URLSearchParams(location.search))
      (keys.includes(key) ? own : others).append(key, value);
    return [own.toString(), others.toString()];
  }

  // Send the address's query to the server as soon as it can receive it.
  function say() {
    unsaid = split()[0];
    deliver();
  }

  // The number makes two equal messages differ, so that viser sends both.
  function deliver() {
    clearTimeout(again);
    if (!window.packetmeshDockRow.write(name, `${said + 1} ${unsaid}`)) return void (again = setTimeout(deliver, 100));
    said += 1;
    unsaid = null;
  }

  window.addEventListener("popstate", say); // the browser's Back and Forward buttons

  return {
    // The keys whose values differ from those at the start.
    get changed() {
      const now = new URLSearchParams(location.search);
      return keys.filter(key => `${now.getAll(key)}` !== `${start.getAll(key)}`);
    },

    // Whether the server has received the place for which the page has asked last.
    get received() {
      return unsaid === null;
    },

    // Start a session: after the page loads or reloads, or when the server is back.
    begin(session, own, from) {
      name = session;
      keys = own;
      start = new URLSearchParams(from);
      say();
    },

    // Go to a place, as a link does.
    ask(text) {
      history.pushState(null, "", `${location.pathname}?${text}`);
      say();
    },

    // Show this query in the address: as a new entry of the browser's history if `place`, else in the current
    // entry. It is ignored while a newer query of the page has not reached the server.
    show(text, place) {
      if (unsaid !== null) return;
      const [own, others] = split();
      const query = others ? `${others}&${text}` : text;
      if (own === text) return;
      history[place ? "pushState" : "replaceState"](null, "", `${location.pathname}?${query}`);
      window.dispatchEvent(new Event("packetmesh-address"));
    },
  };
})();
packetmesh.calls.beginAddress = (_, ...given) => packetmeshAddress.begin(...given);
packetmesh.calls.showAddress = (_, text, place) => packetmeshAddress.show(text, place);
