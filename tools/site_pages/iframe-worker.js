// A page that is opened from the disk may start no Worker, which the site's search is. This one runs its script in a hidden frame.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      this.waiting = []  // what is posted before the script listens
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.appendChild(frame)
      const inside = frame.contentWindow
      this.post = inside.postMessage.bind(inside)
      inside.postMessage = data => {
        const event = new MessageEvent("message", { data })
        this.dispatchEvent(event)
        if (this.onmessage) this.onmessage(event)
      }
      inside.importScripts = (...urls) => Promise.all(urls.map(one => this.load(frame, new URL(one, url))))
      this.load(frame, url).then(() => {
        for (const data of this.waiting) this.post(data, "*")
        this.waiting = undefined
      })
    }
    load(frame, url) {
      return new Promise((done, failed) => {
        const script = frame.contentDocument.createElement("script")
        script.src = url
        script.onload = done
        script.onerror = failed
        frame.contentDocument.body.appendChild(script)
      })
    }
    postMessage(data) {
      if (this.waiting) this.waiting.push(data)
      else this.post(data, "*")
    }
    terminate() {}
  }
}
