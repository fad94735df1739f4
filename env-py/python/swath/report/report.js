// Replays are decoded and built when they are opened.
for (const details of document.querySelectorAll("details[data-replay]")) {
  details.addEventListener("toggle", () => {
    const root = details.querySelector(".player");
    if (!details.open || root.childElementCount) return;
    const data = JSON.parse(document.getElementById(details.dataset.replay).textContent);
    root.tabIndex = 0;
    root.setAttribute("role", "group");
    root.setAttribute("aria-label", `Replay: ${details.querySelector("summary").textContent}`);
    new Player(root, data, root);
  });
}
