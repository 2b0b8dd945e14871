// The stream of events, and whether it is live. The browser reconnects by itself and says with
// Last-Event-ID what it has seen.

const SILENCE_MS = 3500;  // the gateway says something every second

export class Stream {
  // on: { document(doc), reset(), ready(), rigs(list), live(why) }; `why` is empty while all is live.
  constructor(on) {
    this.on = on;
    this.life = undefined;
    this.why = "Connecting to the gateway.";
    this.open();
    setInterval(() => this.watch(), 500);
  }

  open() {
    this.source?.close();
    this.source = new EventSource("events");
    this.heard = performance.now();
    const listen = (name, action) => this.source.addEventListener(name, event => {
      this.heard = performance.now();
      action(event);
    });
    listen("message", event => this.on.document(JSON.parse(event.data)));
    listen("daemon", event => this.greet(JSON.parse(event.data)));
    listen("reset", () => this.on.reset());
    listen("ready", () => this.on.ready());
    listen("rigs", event => {
      this.tell();
      this.on.rigs(JSON.parse(event.data));
    });
    listen("beat", () => this.tell());
    this.source.onerror = () => {
      this.tell("The gateway does not answer: the program shakerd-gateway has ended, or the network is down. " +
                "What you see is old. Trying again.");
      if (this.source.readyState === EventSource.CLOSED) setTimeout(() => this.open(), 1000);
    };
  }

  greet(greeting) {
    const other = this.life !== undefined && greeting.connected && greeting.life !== this.life;
    if (greeting.connected) this.life = greeting.life;
    this.away = greeting.connected ? "" : `${greeting.why.replace(/\.?$/, ".")} What you see is old.`;
    this.tell();
    if (!other) return;
    this.on.reset();
    this.open();  // without a last number: those of another life say nothing
  }

  watch() {
    if (performance.now() - this.heard > SILENCE_MS)
      this.tell(`Nothing has come for ${Math.round((performance.now() - this.heard) / 1000)} s. What you see is old.`);
  }

  tell(why = this.away ?? "") {
    if (why === this.why) return;
    this.why = why;
    this.on.live(why);
  }
}
