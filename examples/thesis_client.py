#!/usr/bin/env python3
"""A trainer in the thesis' own way: takes CONSAC's place with nothing but a socket, and sends no newlines.

    consac serve road-v0 --port 5005 --steps 500 &
    python3 examples/thesis_client.py --port 5005

It reads the setup, then answers each observation with an action: one step towards the coin. It prints the mean reward.
"""
import argparse
import socket


class Messages:
    """Cuts what the engine sends into messages: by newline where the engine sends one, by `#done` where it does not."""

    def __init__(self, connection):
        self.connection, self.text = connection, ""

    def more(self):
        data = self.connection.recv(4096)
        if not data:
            raise ConnectionError("the engine closed the connection")
        self.text += data.decode()

    def setup(self):
        while self.text.count("#") < 6:
            self.more()
        line, _, self.text = self.text.partition("\n")
        return line.strip().split("#")

    def observation(self):
        """o1,o2,...#reward#done: complete as soon as the one character after the second '#' is there."""
        while True:
            self.text = self.text.lstrip("\r\n")
            parts = self.text.split("#", 2)
            if len(parts) == 3 and parts[2]:
                self.text = parts[2][1:]
                return [float(number) for number in parts[0].split(",")], float(parts[1]), parts[2][0] == "1"
            self.more()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=5005)
    options = parser.parse_args()
    with socket.create_connection(("127.0.0.1", options.port)) as connection:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        messages = Messages(connection)
        action_type, actions, _, observation_type, numbers, _, length = messages.setup()[:7]
        print(f"setup: {actions} actions ({action_type}), {numbers} numbers seen ({observation_type}), {length} steps")
        (actor, coin), _, _ = messages.observation()
        total, steps = 0.0, int(length)
        for step in range(steps):
            connection.sendall(b"2" if coin > actor else b"0")
            (actor, coin), reward, done = messages.observation()
            total += reward
            if done and step + 1 < steps:  # not answered: the next message is the new episode's first observation
                (actor, coin), _, _ = messages.observation()
        print(f"training completed: {steps} steps, mean reward {total / steps:.3f}")


if __name__ == "__main__":
    main()
