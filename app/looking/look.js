// How a screen's drawing is looked at (folder.py): cuts, wireframe, light and size of points are set on viser's
// three.js objects before every frame, so that a cut follows its handle at once and nothing is sent again.
window.packetmeshLook = (() => {
  const HANDLES_MS = 4000; // handles are shown for so long after a movement of the pointer, a change, or full screen
  const SHADE = 0.3; // of a surface that the light does not reach
  const looks = new Map(); // by the screen's node: its parts, its state, and whether anything of it was ever unusual
  const usual = new WeakMap(); // by material: the size of its points, and the size that was set
  let until = 0; // time at which the handles are hidden, ms
  let hiding = 0; // timer that draws the picture without handles

  const nodes = () => window.__viserMutable?.nodeRefFromName ?? {};

  function isShown(object) {
    for (let one = object; one; one = one.parent) if (!one.visible) return false;
    return Boolean(object);
  }

  // Return the planes of a cut in three.js's world, moved along with a part: {normal, constant} as three.js uses them.
  function planesOf(look, root, part) {
    const Vector = root.position.constructor;
    const moved = part.matrixWorld.clone().multiply(root.matrixWorld.clone().invert());
    return look.planes.map(plane => {
      const handle = nodes()[plane.handle];
      const [from, normal, point] = handle
        ? [handle.matrixWorld, plane.axis, [0, 0, 0]]
        : [root.matrixWorld, plane.normal, plane.point];
      const matrix = moved.clone().multiply(from);
      const at = new Vector(...point).applyMatrix4(matrix);
      const facing = new Vector(...normal).transformDirection(matrix).multiplyScalar(look.inside ? -1 : 1);
      const found = {normal: facing, constant: -facing.dot(at)};
      return Object.assign(found, {clone: () => found}); // three.js clones the planes of a material that it copies
    });
  }

  function isCut(planes, inside, {x, y, z}) {
    const behind = plane => plane.normal.x * x + plane.normal.y * y + plane.normal.z * z + plane.constant < 0;
    return planes.length > 0 && (inside ? planes.every(behind) : planes.some(behind));
  }

  // viser's shader of points knows no planes: add three.js's own.
  function cutPoints(shader) {
    shader.vertexShader = shader.vertexShader
      .replace("#include <fog_pars_vertex>", "#include <fog_pars_vertex>\n#include <clipping_planes_pars_vertex>")
      .replace("gl_PointSize =", "vec4 mvPosition = world_pos;\n#include <clipping_planes_vertex>\ngl_PointSize =");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <fog_pars_fragment>", "#include <fog_pars_fragment>\n#include <clipping_planes_pars_fragment>")
      .replace("void main() {", "void main() {\n#include <clipping_planes_fragment>");
  }

  // The app's surfaces have no light of their own; the light falls on each triangle.
  function lit(light) {
    return Object.assign(shader => {
      shader.uniforms.packetmeshLight = light;
      shader.vertexShader = shader.vertexShader
        .replace("void main() {", "varying vec3 packetmeshAt;\nvoid main() {")
        .replace("#include <project_vertex>",
          "#include <project_vertex>\npacketmeshAt = (modelMatrix * vec4(transformed, 1.0)).xyz;");
      shader.fragmentShader = shader.fragmentShader
        .replace("void main() {", "varying vec3 packetmeshAt;\nuniform vec3 packetmeshLight;\nvoid main() {")
        .replace("#include <opaque_fragment>",
          "vec3 packetmeshFacing = normalize(cross(dFdx(packetmeshAt), dFdy(packetmeshAt)));\n" +
          `outgoingLight *= mix(${SHADE.toFixed(2)}, 1.15, max(dot(packetmeshFacing, packetmeshLight), 0.0));\n` +
          "#include <opaque_fragment>");
    }, {light});
  }

  function sizePoints(material, size, renderer, camera) {
    const scale = material.uniforms.scale;
    const known = usual.get(material) ?? {};
    if (scale.value !== known.set) known.own = scale.value; // viser has computed it anew
    known.set = size > 0
      ? size / Math.tan(camera.fov * Math.PI / 360) * renderer.domElement.height // as viser computes it
      : known.own;
    scale.value = known.set;
    usual.set(material, known);
  }

  function dressMaterial(material, object, look, planes, renderer, camera) {
    const isCloud = Boolean(material.uniforms?.point_ball_norm);
    if (isCloud) {
      if (planes.length > 0 && !material.clipping) {
        material.onBeforeCompile = cutPoints;
        Object.assign(material, {clipping: true, needsUpdate: true});
      }
      sizePoints(material, look.point, renderer, camera);
    }
    material.clippingPlanes = planes.length > 0 ? planes : null;
    material.clipIntersection = look.inside;
    if (!object.isMesh || !material.isMeshBasicMaterial || !object.geometry.attributes.color) return;
    material.wireframe = look.wire;
    const wanted = look.light ? look.lit : null;
    if ((material.userData.packetmeshLit ?? null) === wanted) return;
    material.userData.packetmeshLit = wanted;
    material.onBeforeCompile = wanted ?? (() => {});
    material.needsUpdate = true;
  }

  function dress(object, found, planes, given) {
    const {root, parts, look, handles} = found;
    if (object === handles) return;
    const own = parts.includes(object) ? planesOf(look, root, object) : planes;
    for (const material of [object.material ?? []].flat()) dressMaterial(material, object, look, own, ...given);
    for (const child of object.children) dress(child, found, own, given);
  }

  const placeKey = ({x, y, z}) => [x, y, z].map(Math.fround).join();

  // Return, by place, the planes for labels of a part, which is cut where it stands; none for the part's own name.
  function planesOfLabels(names, root, look) {
    const found = new Map();
    const {nodePoseData, nodeRefFromName} = window.__viserMutable;
    for (const name of names) {
      const part = nodeRefFromName[name];
      if (!part) continue;
      const planes = planesOf(look, root, part);
      for (const [label, {position}] of Object.entries(nodePoseData)) {
        const parent = label.startsWith(`${name}/`) && nodeRefFromName[label.slice(0, label.lastIndexOf("/"))];
        if (!parent) continue;
        const place = new root.position.constructor(...position ?? [0, 0, 0]).applyMatrix4(parent.matrixWorld);
        found.set(placeKey(place), label === `${name}/label` ? [] : planes);
      }
    }
    return found;
  }

  // Labels are drawn all at once; those in the part that is cut off get no visibility.
  function hideLabels(scene, planes, inside, ofParts) {
    const labels = new Set();
    scene.traverse(object => {
      const texture = object.material?.uniforms?.uLabelData?.value;
      if (texture) labels.add(texture);
    });
    for (const {image: {data}} of labels)
      for (let at = 0; at < data.length; at += 4) {
        if (data[at + 3] === 0) continue;
        const place = {x: data[at], y: data[at + 1], z: data[at + 2]};
        if (isCut(ofParts.get(placeKey(place)) ?? planes, inside, place)) data[at + 3] = 0;
      }
  }

  function beforeFrame(renderer, scene, camera) {
    for (const [below, {names, look, used}] of looks) {
      const root = nodes()[below];
      if (!used || !isShown(root)) continue;
      const handles = nodes()[`${below}/look`];
      if (handles) handles.visible = performance.now() < until;
      const planes = planesOf(look, root, root);
      renderer.localClippingEnabled ||= planes.length > 0;
      const parts = names.map(name => nodes()[name]).filter(Boolean);
      if (look.light) turnLight(look, root);
      dress(root, {root, parts, look, handles}, planes, [renderer, camera]);
      if (planes.length > 0) hideLabels(scene, planes, look.inside, planesOfLabels(names, root, look));
    }
  }

  function turnLight(look, root) {
    const [azimuth, height] = look.light.map(degrees => degrees * Math.PI / 180);
    look.lit.light.value = new root.position.constructor(
      Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height),
    ).transformDirection(root.matrixWorld);
  }

  // Show the handles for a while.
  function wake() {
    const asleep = performance.now() >= until;
    until = performance.now() + HANDLES_MS;
    clearTimeout(hiding);
    hiding = setTimeout(() => window.packetmeshFrames.draw(), HANDLES_MS + 50);
    if (asleep) window.packetmeshFrames.draw();
  }
  const cutting = () => [...looks.values()].some(({look}) => look.planes.length > 0);
  for (const kind of ["pointermove", "pointerdown"])
    window.addEventListener(kind, ({target}) => {
      if (cutting() && target === document.querySelector("canvas[data-engine]")) wake();
    }, true);
  window.addEventListener("packetmesh-alone", () => cutting() && wake());

  window.packetmeshFrames.before(beforeFrame);

  window.packetmesh.calls.look = (_, below, names, look) => {
    const before = looks.get(below);
    const used = Boolean(before?.used || look.planes.length || look.wire || look.point || look.light);
    looks.set(below, {names, used, look: {...look, lit: before?.look.lit ?? lit({value: null})}});
    if (look.planes.length > 0) wake();
    window.packetmeshFrames.draw();
  };

  // Return the look of the screen that is shown, with its node.
  function shown() {
    for (const [below, {look}] of looks) if (isShown(nodes()[below])) return {look, root: nodes()[below]};
    return null;
  }

  return {shown};
})();
