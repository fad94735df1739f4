// The search runs in a worker, which browsers refuse to pages that are opened from a folder: there a frame stands in for it.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super();
      this.frame = document.createElement("iframe");
      this.frame.hidden = true;
      this.isReady = new Promise((resolve) => { this.frame.onload = resolve; });
      this.frame.srcdoc =
        "<script>postMessage = (data) => parent.dispatchEvent(new CustomEvent('frame', {detail: data}));" +
        "importScripts = () => {};</" + `script><script src="${new URL(url, location).href}"></` + "script>";
      window.addEventListener("frame", ({ detail }) => {
        const event = new MessageEvent("message", { data: detail });
        this.dispatchEvent(event);
        if (this.onmessage) this.onmessage(event);
      });
      document.body.append(this.frame);
    }

    postMessage(data) {
      this.isReady.then(() => this.frame.contentWindow.dispatchEvent(new MessageEvent("message", { data })));
    }
  };
}
