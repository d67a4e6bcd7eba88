// The lanes of a race have one place in the scene; the page draws each into its own window of the picture. So a
// turned view turns every lane about its own middle, and no lane reaches into another one's window.
window.packetmeshLanes = (() => {
  const NODE = "/fuse/race/lane"; // draw.py
  const POINTED = ["pointermove", "pointerdown", "pointerup", "pointercancel", "click", "dblclick", "contextmenu"];

  let count = 0; // lanes that are drawn; none without a race
  let band = [0, 0, 1];
  const hooked = new WeakSet(); // objects of lanes that already move to their window
  let held = null; // the lane in which a drag began

  const canvas = () => document.querySelector("canvas[data-engine]");

  // Return how far a lane is from the middle of the picture, to the right and up, in halves of the picture's size.
  function shift(lane) {
    const [head, headPx, foot] = band;
    const top = Math.max(head, headPx / Math.max(canvas().clientHeight, 1));
    return [(2 * lane + 1) / count - 1, 1 - top - foot];
  }

  // Return the transform of the scene that moves its picture by that much without a change of perspective.
  function moved(camera, lane) {
    const [right, up] = shift(lane);
    const {0: across, 5: down} = camera.projectionMatrix.elements;
    const shear = camera.matrixWorld.clone().set(
      1, 0, -right / across, 0,
      0, 1, -up / down, 0,
      0, 0, 1, 0,
      0, 0, 0, 1);
    return camera.matrixWorld.clone().multiply(shear).multiply(camera.matrixWorldInverse);
  }

  function clip(renderer, lane) {
    const {drawingBufferWidth: width, drawingBufferHeight: height} = renderer.getContext();
    const left = Math.round(lane * width / count);
    renderer.state.setScissorTest(true);
    renderer.state.scissor({x: left, y: 0, z: Math.round((lane + 1) * width / count) - left, w: height});
  }

  function hook(object, lane) {
    const {onBeforeRender, onAfterRender} = object;
    let own = null; // the object's place while it is drawn elsewhere
    object.onBeforeRender = (renderer, scene, camera, ...rest) => {
      onBeforeRender.call(object, renderer, scene, camera, ...rest);
      if (lane >= count) return;
      own = object.matrixWorld.clone();
      object.matrixWorld.premultiply(moved(camera, lane));
      clip(renderer, lane);
    };
    object.onAfterRender = (renderer, ...rest) => {
      if (own) {
        object.matrixWorld.copy(own);
        renderer.state.setScissorTest(false);
        own = null;
      }
      onAfterRender.call(object, renderer, ...rest);
    };
  }

  function hookAll() {
    for (let lane = 0; lane < count; lane += 1)
      window.__viserMutable?.nodeRefFromName?.[NODE + lane]?.traverse(object => {
        if (!(object.isMesh || object.isLine || object.isPoints) || hooked.has(object)) return;
        hooked.add(object);
        hook(object, lane);
      });
  }

  window.packetmeshFrames.before(hookAll);

  // Shift a pointer event from the place in its lane's window to the same place of the lane in the scene.
  function shiftPointer(event) {
    const {offsetX: x, offsetY: y, target: {clientWidth: width, clientHeight: height}} = event;
    const under = Math.max(0, Math.min(count - 1, Math.floor(count * x / width)));
    if (event.type === "pointerdown") held = under;
    const [right, up] = shift(held ?? under);
    Object.defineProperties(event, {offsetX: {value: x - 0.5 * right * width}, offsetY: {value: y + 0.5 * up * height}});
  }

  // Whether the race is in the picture, not another screen's drawing.
  function isShown() {
    let node = window.__viserMutable?.nodeRefFromName?.[`${NODE}0`];
    if (!node) return false;
    for (; node; node = node.parent) if (!node.visible) return false;
    return true;
  }

  function point(event) {
    if (count > 0 && event.target === canvas() && isShown()) shiftPointer(event);
    if (["pointerup", "pointercancel"].includes(event.type)) held = null; // also where a drag ends outside the picture
  }
  for (const kind of POINTED) window.addEventListener(kind, point, true);

  // Draw this number of lanes from now on, between the edges of a band: the upper edge as a share of the picture's
  // height and its least distance in px, the lower edge as a share.
  return {show(lanes, edges) {
    [count, band] = [lanes, edges];
    held = null;
    window.packetmeshFrames.draw();
  }};
})();
