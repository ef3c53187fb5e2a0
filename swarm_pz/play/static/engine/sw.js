// Cache the page's files, so that it opens without a network; `swarm-pz site` fills in their names and a version.

const VERSION = "", FILES = [];
const NAME = `${registration.scope} ${VERSION}`;

addEventListener("install", (event) => event.waitUntil(
  caches.open(NAME).then((cache) => cache.addAll(FILES.map((file) => new Request(file, { cache: "no-cache" })))),
));
addEventListener("activate", (event) => event.waitUntil(
  caches.keys().then((names) => names.filter((name) => name.startsWith(`${registration.scope} `) && name !== NAME))
    .then((old) => Promise.all(old.map((name) => caches.delete(name)))),
));
addEventListener("fetch", (event) => {
  const { request } = event, wanted = request.mode === "navigate" ? registration.scope : request;
  event.respondWith(caches.open(NAME).then((cache) => cache.match(wanted, { ignoreSearch: true })).then((hit) => hit ?? fetch(request)));
});
