#!/usr/bin/env python3
"""An engine in the thesis' own way: a road world behind a plain socket, no newlines, nothing of CONSAC's.

    python3 examples/thesis_server.py --port 5005 &
    consac train tcp://127.0.0.1:5005 --name walker

An actor walks a road from 0 to 40 towards a coin. Messages carry no terminator, so the engine pauses for a quiet time
where one message could run into the next: after the setup, and after the end of an episode.
"""
import argparse
import random
import socket
import time

LENGTH, LOW, HIGH, QUIET = 200, 0, 40, 0.02


def serve(connection, steps, episode_seed):
    rng = random.Random(episode_seed)
    send = lambda text: connection.sendall(text.encode())
    send(f"D#3#0#B#2#{LOW},{LOW},{HIGH},{HIGH}#{steps}")  # three actions; observation actor, coin
    time.sleep(QUIET)
    actor, coin, walked = 10, rng.randint(LOW, HIGH), 0
    send(f"{actor},{coin}#0#0")
    for _ in range(steps):
        data = connection.recv(64)  # one character: an action has at most ten choices
        if not data:
            return
        before = abs(coin - actor)
        actor += int(data.decode().strip()[-1]) - 1
        reward = 1 if abs(coin - actor) < before else 0
        walked += 1
        left_the_road = not LOW <= actor <= HIGH
        actor = min(max(actor, LOW), HIGH)
        if actor == coin:
            coin = rng.randint(LOW, HIGH)
        send(f"{actor},{coin}#{reward}#{int(left_the_road or walked == LENGTH)}")
        if left_the_road or walked == LENGTH:
            time.sleep(QUIET)
            actor, coin, walked = rng.randint(LOW, HIGH), rng.randint(LOW, HIGH), 0
            send(f"{actor},{coin}#0#0")
    connection.recv(64)  # the trainer closes: training completed


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--port", type=int, default=5005, help="0 takes a free one and prints it")
    parser.add_argument("--steps", type=int, default=2000, help="training length, in actions")
    options = parser.parse_args()
    with socket.create_server(("127.0.0.1", options.port)) as listener:
        print(f"engine: waiting for a trainer on port {listener.getsockname()[1]}", flush=True)
        connection, _ = listener.accept()
        with connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            try:
                serve(connection, options.steps, episode_seed=1)
            except (ConnectionError, OSError) as error:
                print(f"engine: the trainer went away ({error})")
    print("engine: session over")


if __name__ == "__main__":
    main()
