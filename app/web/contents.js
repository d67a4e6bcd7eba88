// Fetches the contents that messages name (contents.py) and puts them into the messages before viser gets these.
//
// Messages stay in order: those after a content wait for it. On a slow line they wait only for the coarse copy of a
// first large mesh, which the mesh replaces when it comes. A scene node or control whose content nobody would see,
// because it is hidden or lies in something hidden, is held back with all its messages until it is shown. When a
// quick line is idle, held contents are fetched ahead.
(() => {
  const FOLDER = "contents/";
  const TRIES = 4;
  const PAUSE_MS = 1000; // before a fetch is tried again
  const IDLE_MS = 2500; // time without new contents after which held ones are fetched ahead
  const ASIDE_MS = 4000; // longest time for which the first screen waits until the address's screen is shown
  const PATIENCE_MS = 60000; // longest fetch
  const RETRY_MS = 300000; // least time between two connections that the page begins anew because of a lost content
  const MEASURED_BYTES = 100000; // least size of a content that tells the line's rate
  const SHOWN_MS = 20000;
  const SLOW_B_PER_MS = 500; // rate of the last bytes below which coarse copies come first, and nothing ahead
  const COARSE = "A coarse surface, until the whole one has arrived.";
  const LOST = "A part of the page did not arrive: reload it.";
  const ARRAYS = {
    "": Uint8Array, "|u1": Uint8Array, "|i1": Int8Array, "<u2": Uint16Array, "<i2": Int16Array, "<f2": Uint16Array,
    "<u4": Uint32Array, "<i4": Int32Array, "<f4": Float32Array, "<f8": Float64Array,
  };
  const FIRST = "/scene"; // the node of the screen that a session shows before it has read the page's address
  const SCREENS = ["calibrate", "depth", "fuse", "surface", "network", "export"]; // the others
  const VISIBILITY = "SetSceneNodeVisibilityMessage";
  const REMOVALS = ["RemoveSceneNodeMessage", "GuiRemoveMessage"];
  const UPDATES = ["SceneNodeUpdateMessage", "GuiUpdateMessage"];

  const hidden = new Set(); // nodes and controls that are not shown themselves
  const containers = new Map(); // for each control the one that holds it
  const held = new Map(); // for each held node or control its messages
  const lost = new Set(); // names of contents that could not be fetched ahead
  const loading = new Map(); // for each name of a content, or of its coarse copy, the promise of its bytes
  const drawn = new Set(); // nodes with a content that has a coarse copy
  const refining = new Map(); // for each node that is drawn coarsely its content
  let aside = false; // whether the address names another screen than the first, which is not shown yet
  let deliver = () => {}; // gives viser's page an event
  let chain = Promise.resolve(); // the deliveries that wait for contents
  let waiting = 0; // their number
  let connection = 0; // number of the connection whose messages are valid
  let ended = new AbortController(); // ends the fetches of this connection
  let idle = 0; // timer of the fetches ahead
  let bytesPerMs = Infinity; // rate of the line
  let worker = null; // holds the websocket
  let retriedMs = -Infinity; // when the page last began a connection anew

  // Take the line's rate from a large enough response, which did not come from the browser's cache.
  function measure({transferSize, responseStart, responseEnd} = {}) {
    if (transferSize > MEASURED_BYTES) bytesPerMs = transferSize / Math.max(responseEnd - responseStart, 1);
  }
  performance.setResourceTimingBufferSize(10000);
  measure(performance.getEntriesByType("navigation")[0]);

  const isContent = value => value !== null && typeof value === "object" && typeof value.packetmesh === "string";

  // Yield each content in a message, with its place.
  function* contentsOf(value) {
    if (value === null || typeof value !== "object" || ArrayBuffer.isView(value)) return;
    for (const [key, one] of Object.entries(value))
      if (isContent(one)) yield [value, key, one];
      else yield* contentsOf(one);
  }

  async function fetched(name, ahead) {
    const {signal} = ended;
    for (let tried = 1; ; tried++) {
      try {
        const url = new URL(FOLDER + name, document.baseURI).href;
        const answer = await fetch(url, {
          priority: ahead ? "low" : "high",
          cache: tried > 1 ? "reload" : "default", // what the browser kept may be damaged
          signal: AbortSignal.any([signal, AbortSignal.timeout(PATIENCE_MS)]),
        });
        if (answer.ok) {
          const packed = await answer.arrayBuffer();
          measure(performance.getEntriesByName(url).at(-1));
          return packetmeshUnpack(new Uint8Array(packed));
        }
        if (answer.status < 500) throw new RangeError(LOST);
      } catch (error) {
        if (error instanceof RangeError || tried === TRIES || signal.aborted) throw error;
      }
      await new Promise(done => setTimeout(done, tried * PAUSE_MS));
    }
  }

  function load(name, ahead = false) {
    if (!loading.has(name)) loading.set(name, fetched(name, ahead));
    return loading.get(name);
  }

  const isSlow = () => bytesPerMs < SLOW_B_PER_MS;
  const above = name => name.slice(0, name.lastIndexOf("/"));

  // The name to fetch for a content of a node: that of the coarse copy on a slow line, unless a mesh is there.
  function first(content, node) {
    const name = content.packetmesh;
    if (!content.coarse || !isSlow()) return name;
    return [...drawn].some(other => above(other) === above(node)) ? name : `${name}?coarse`;
  }

  const typed = (bytes, {dtype}) => new (ARRAYS[dtype] ?? Uint8Array)(bytes.slice().buffer);

  // Put the contents into a message; false if one did not arrive.
  async function filled(found, wanted) {
    try {
      for (const [owner, key, content] of found) owner[key] = typed(await load(wanted.get(content)), content);
      return true;
    } catch {
      return false;
    }
  }

  // What a message is about: a scene node's name or a control's uuid; undefined for others.
  const subject = ({type, name, uuid, virtual}) =>
    name?.startsWith?.("/") && !virtual ? name : type.startsWith("Gui") ? uuid : undefined;

  function isHidden(one) {
    if (aside) return true;
    if (one.startsWith("/")) return [...hidden].some(above => one === above || one.startsWith(`${above}/`));
    for (let within = one; within !== undefined; within = containers.get(within)) if (hidden.has(within)) return true;
    return false;
  }

  function note(message) {
    const one = subject(message);
    if (one === undefined) return;
    const {type, props, updates} = message;
    const visible = type === VISIBILITY ? message.visible : (props ?? updates)?.visible;
    if (props && message.container_uuid) containers.set(one, message.container_uuid);
    if (visible === false) hidden.add(one);
    else if (visible === true || props || REMOVALS.includes(type)) hidden.delete(one);
    if (REMOVALS.includes(type)) containers.delete(one);
    if (type === VISIBILITY && visible && one.lastIndexOf("/") === 0 && one !== FIRST) aside = false;
  }

  // Add a message to those of its held subject, in place of what it replaces.
  function hold(messages, message) {
    const [first] = messages, known = messages.findIndex(({type}) => type === message.type);
    if (UPDATES.includes(message.type)) Object.assign(first.props ?? first.updates, message.updates);
    else if (known > 0) messages[known] = message;
    else messages.push(message);
  }

  // Split the messages of a batch: return those for viser now, and keep those of held subjects.
  function sorted(batch) {
    batch.forEach(note);
    const passed = released();
    for (const message of batch) {
      const {type} = message, one = subject(message), named = !contentsOf(message).next().done;
      const fresh = REMOVALS.includes(type) || message.props;
      if (fresh) held.delete(one);
      if (held.has(one)) hold(held.get(one), message);
      else if (one !== undefined && named && isHidden(one)) held.set(one, [message]);
      else passed.push(message);
    }
    return passed;
  }

  // Return the messages of subjects that are hidden no more.
  function released() {
    const passed = [];
    for (const [one, messages] of held)
      if (!isHidden(one)) {
        passed.push(...messages);
        held.delete(one);
      }
    return passed;
  }

  // Fetch the next held content, and forget those that are no longer needed.
  function fetchAhead() {
    if (waiting > 0 || refining.size > 0 || isSlow()) return;
    const needed = new Set([...held.values()].flatMap(found => found.flatMap(message => [...contentsOf(message)]))
      .map(([, , {packetmesh: name}]) => name));
    for (const name of loading.keys()) if (!needed.has(name)) loading.delete(name);
    const next = [...needed].find(name => !loading.has(name) && !lost.has(name));
    if (next === undefined) return;
    const mine = connection;
    const giveUp = () => {
      if (mine !== connection) return;
      loading.delete(next);
      lost.add(next);
    };
    load(next, true).catch(giveUp).then(() => mine === connection && fetchAhead());
  }

  // Give viser messages once their contents are there.
  function pass(messages) {
    const mine = connection, named = messages.map(message => [...contentsOf(message)]);
    if (waiting === 0 && !named.flat().length) return send(messages);
    const wanted = new Map(named.flatMap((found, row) =>
      found.map(([, , content]) => [content, first(content, messages[row].name)])));
    for (const name of wanted.values()) load(name).catch(() => {});
    waiting += 1;
    chain = chain.then(async () => {
      const came = await Promise.all(named.map(found => filled(found, wanted)));
      if (mine !== connection) return;
      waiting -= 1;
      if (came.includes(false) && beginAnew()) return;
      for (const name of wanted.values()) loading.delete(name);
      send(messages.filter((_, row) => came[row]));
      messages.forEach((message, row) => came[row] && refine(message, named[row], wanted));
      rest();
    });
  }

  // A content is gone: connect again, after which the server offers everything anew. False if that was just tried.
  function beginAnew() {
    if (performance.now() - retriedMs < RETRY_MS) {
      packetmesh.notice(LOST, SHOWN_MS);
      return false;
    }
    retriedMs = performance.now();
    worker.postMessage({type: "retry"});
    return true;
  }

  function rest() {
    clearTimeout(idle);
    idle = setTimeout(fetchAhead, IDLE_MS);
  }

  function send(messages) {
    if (!messages.length) return;
    for (const {type, name, props, updates} of messages) {
      if (REMOVALS.includes(type)) drawn.delete(name);
      if (REMOVALS.includes(type) || props || updates?.[refining.get(name)?.key]) refined(name);
    }
    deliver({data: {type: "message_batch", messages}});
  }

  // Fetch what a message has only a coarse copy of, and update its node unless that has changed.
  async function refine({name, owner}, found, wanted) {
    for (const [, key, content] of found) {
      if (content.coarse) drawn.add(name);
      if (wanted.get(content) === content.packetmesh) continue;
      const mine = {key};
      refining.set(name, mine);
      packetmesh.notice(COARSE, SHOWN_MS);
      const bytes = await load(content.packetmesh).catch(() => null);
      loading.delete(content.packetmesh);
      if (refining.get(name) !== mine) return;
      refined(name);
      if (bytes === null) return void beginAnew();
      send([{type: "SceneNodeUpdateMessage", name, owner, updates: {[key]: typed(bytes, content)}}]);
      rest();
    }
  }

  function refined(name) {
    if (refining.delete(name) && !refining.size) packetmesh.notice("", 0);
  }

  function reset() {
    const mine = ++connection;
    ended.abort(); // the line is for this connection's contents
    ended = new AbortController();
    chain = Promise.resolve();
    waiting = 0;
    for (const all of [hidden, containers, held, lost, loading, drawn, refining]) all.clear();
    const screen = new URLSearchParams(location.search).get("screen");
    aside = SCREENS.includes(screen);
    setTimeout(() => {
      if (mine !== connection) return;
      aside = false;
      pass(released());
    }, ASIDE_MS);
  }

  // viser's page makes a worker that opens the websocket, and listens to what it posts.
  window.Worker = class extends Worker {
    set onmessage(listener) {
      super.onmessage = listener && (event => {
        if (event.data?.type === "message_batch") {
          [deliver, worker] = [listener, this];
          pass(sorted(event.data.messages));
          return;
        }
        if (event.data?.type === "connected") reset();
        listener(event);
      });
    }

    get onmessage() {
      return super.onmessage;
    }
  };
})();
