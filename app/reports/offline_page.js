// Access to the data in the page: elements, and bytes from base64.

const find = id => document.getElementById(id);

function bytesOf(id) {
  const element = find(id);
  return element && Uint8Array.from(atob(element.textContent), letter => letter.charCodeAt(0));
}

async function inflate(id) {
  const stream = new Blob([bytesOf(id)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function toggleLight() {
  const root = document.documentElement;
  const dark = getComputedStyle(root).getPropertyValue("--dark").trim() === "1";
  root.dataset.light = dark ? "light" : "dark";
}
