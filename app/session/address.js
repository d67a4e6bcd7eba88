// The address of the page: what stands in it is what the app shows, and the other way round. It is in the
// query, beside what viser puts there, for viser cannot connect from an address with a # in it.
window.packetmeshAddress = (() => {
  let name = null; // of the session's hidden field
  let keys = []; // its own in the query
  let said = 0;
  let unsaid = null; // what the server has yet to hear
  let again = 0; // the timer of the next try to say it

  function split() {
    const own = new URLSearchParams(), others = new URLSearchParams();
    for (const [key, value] of new URLSearchParams(location.search))
      (keys.includes(key) ? own : others).append(key, value);
    return [own.toString(), others.toString()];
  }

  // To the server, as soon as it hears: what the address asks for.
  function say() {
    unsaid = split()[0];
    deliver();
  }

  // A number tells two that are alike apart.
  function deliver() {
    clearTimeout(again);
    if (!window.packetmeshDockRow.write(name, `${said + 1} ${unsaid}`)) return void (again = setTimeout(deliver, 100));
    said += 1;
    unsaid = null;
  }

  window.addEventListener("popstate", say); // Back and forward

  return {
    // A session has begun: by a new page, a reload, or after the server was away.
    begin(session, own) {
      name = session;
      keys = own;
      say();
    },

    // Go to a place, as a link does.
    ask(text) {
      history.pushState(null, "", `${location.pathname}?${text}`);
      say();
    },

    // What is shown now; a place of its own among those that Back knows, or a change to the one before. It is
    // out of date while the server has yet to hear what was asked for meanwhile.
    show(text, place) {
      if (unsaid !== null) return;
      const [own, others] = split();
      const query = others ? `${others}&${text}` : text;
      if (own !== text) history[place ? "pushState" : "replaceState"](null, "", `${location.pathname}?${query}`);
    },
  };
})();
packetmesh.calls.beginAddress = (_, session, own) => packetmeshAddress.begin(session, own);
packetmesh.calls.showAddress = (_, text, place) => packetmeshAddress.show(text, place);
