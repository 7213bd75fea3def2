// Foxglove's own client: subscribes to every channel, and prints a line of JSON for whatever it gets.
//     node client.mjs ws://127.0.0.1:7480/foxglove PROTOCOL
import protocol from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const [address, name] = process.argv.slice(2);
const client = new protocol.FoxgloveClient({ ws: new WebSocket(address, [name]) });
const topics = new Map();

function print(value) {
  process.stdout.write(JSON.stringify(value) + "\n");
}

client.on("serverInfo", (info) => print(info));
client.on("status", (status) => print(status));
client.on("advertise", (channels) => {
  print({ op: "advertise", channels });
  for (const channel of channels) {
    topics.set(client.subscribe(channel.id), channel.topic);
  }
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const message = Buffer.from(data.buffer, data.byteOffset, data.byteLength).toString("base64");
  print({ op: "message", topic: topics.get(subscriptionId), timestamp: timestamp.toString(), message });
});
client.on("error", (error) => print({ op: "error", message: String(error) }));
client.on("close", () => process.exit(0));
// The test ends this program by closing its input.
process.stdin.resume().on("end", () => process.exit(0));
