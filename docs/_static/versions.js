// Other versions of these pages, beside the folder of this one: docs/versions.py writes their list. Where there is no
// other, or no server that could send the list, the choice stays hidden.
const choice = document.querySelector(".versions select");
const own = new URL(document.documentElement.dataset.content_root, location.href);

async function go() {
  const there = new URL(`../${choice.value}/${location.href.slice(own.href.length)}`, own);
  const { ok } = await fetch(there, { method: "HEAD" });
  location.assign(ok ? there : new URL(`../${choice.value}/index.html`, own));
}

async function offer() {
  const list = await fetch(new URL("../versions.json", own));
  const versions = list.ok ? await list.json() : [];
  if (versions.length < 2) return;
  for (const name of versions) {
    choice.add(new Option(name, name, false, name === choice.dataset.version));
  }
  choice.addEventListener("change", go);
  choice.parentElement.hidden = false;
}

if (choice && location.protocol !== "file:") offer();
