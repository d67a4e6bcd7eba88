// Functions that run before every frame of the 3-D picture.
window.packetmeshFrames = (() => {
  const POLL_MS = 100;
  const actions = [];
  let waiting = 0; // timer that looks for viser's scene

  // Draw a frame, and run the functions before it and all later ones.
  function draw() {
    clearTimeout(waiting);
    const viewer = window.__viserMutable;
    if (!viewer?.scene) return void (waiting = setTimeout(draw, POLL_MS));
    viewer.scene.onBeforeRender = (...given) => actions.forEach(action => action(...given));
    viewer.requestRender?.();
  }

  return {
    // Run `action(renderer, scene, camera)` before every frame after the next call of `draw`.
    before(action) {
      actions.push(action);
    },
    draw,
  };
})();
