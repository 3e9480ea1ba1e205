"""`python -m consac.serve`: its arguments, and the server until it is told to end."""
from __future__ import annotations

import argparse
import os
import signal
import sys

from consac.extras import Parameter
from consac.names import printable_line

from .limits import Limits
from .refusal import INTERRUPTIBLE, describe, place_of, traceback_of
from .server import Server
from .world import GROUPS, environment_maker, pettingzoo_maker


def parameter_of(text: str) -> Parameter:
    """What --parameter says."""
    name, equals, numbers = text.partition("=")
    try:
        values = [float(number) for number in numbers.split(":")]
        if not equals or len(values) not in (1, 3):
            raise ValueError
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} cannot be used; expected name=value or name=value:low:high") from None
    return Parameter(name, *values)


def main(arguments=None) -> int:
    parser = argparse.ArgumentParser(prog="python -m consac.serve", description="Serves any Gymnasium or PettingZoo environment to CONSAC's trainers.")
    parser.add_argument("world", nargs="?", help="Gymnasium id, or module:attribute of a callable that makes an environment")
    parser.add_argument("--pettingzoo", metavar="MODULE", help="a module with parallel_env, as pettingzoo.mpe.simple_spread_v3")
    parser.add_argument("--envs", type=int, default=1, help="environments of each session")
    parser.add_argument("--host", default="127.0.0.1", help="address to bind; another than loopback needs --token")
    parser.add_argument("--port", type=int, default=5005, help="0 takes a free one")
    parser.add_argument("--port-file", metavar="F", help="the port is written here once it is open")
    parser.add_argument("--token", default=os.environ.get("CONSAC_TOKEN", ""), help="that clients must have; better set CONSAC_TOKEN: other users see command lines")
    parser.add_argument("--steps", type=int, default=0, metavar="N", help="training length that is asked for")
    parser.add_argument("--model", default="", metavar="NAME", help="model that the trainer saves or finds")
    parser.add_argument("--seed", type=int, help="of the first reset, where the client gives none")
    parser.add_argument("--sessions", type=int, default=0, metavar="N", help="end after so many sessions in which a trainer has stepped; 0: never")
    parser.add_argument("--max-sessions", type=int, default=8, metavar="N", help="at once")
    parser.add_argument("--protocol", choices=["auto", "text1", "2"], default="auto")
    parser.add_argument("--no-render", action="store_true", help="make environments that do not draw")
    parser.add_argument("--group", choices=GROUPS, default="kind", help="of several agents those of one kind (a name, and a number behind it) share a policy, or all with equal spaces")
    parser.add_argument("--parameter", action="append", default=[], type=parameter_of, metavar="NAME=VALUE[:LOW:HIGH]", help="a number that trainers may set, what it is unless they do, and its bounds; reset() finds it in its options, by name. May come again")
    parser.add_argument("--statistic", action="append", default=[], metavar="NAME", help="a number in the environment's infos that goes into the trainer's log. May come again")
    options = parser.parse_args(arguments)
    log = lambda line: print(line, file=sys.stderr, flush=True)
    if (options.world is None) == (options.pettingzoo is None):
        parser.error("name one world: a Gymnasium id, module:attribute, or --pettingzoo MODULE")
    try:
        factory = environment_maker(options.world, not options.no_render) if options.world else pettingzoo_maker(options.pettingzoo, not options.no_render)
        server = Server(factory, options.envs, host=options.host, port=options.port, token=options.token, protocol=options.protocol,
                        training_length=options.steps, model_name=options.model, seed=options.seed, sessions=options.sessions,
                        limits=Limits(max_sessions=options.max_sessions), group=options.group, parameters=options.parameter, statistics=options.statistic, log=log)
    except INTERRUPTIBLE as error:
        if place_of(error):
            for line in traceback_of(error):
                log(printable_line(line))
        log(f"consac.serve: {describe(error)}")
        return 2
    for name in (signal.SIGINT, signal.SIGTERM):
        signal.signal(name, lambda *_: server.end())
    if options.port_file:
        fresh = f"{options.port_file}.{os.getpid()}"
        with open(fresh, "w") as file:
            file.write(f"{server.port}\n")
        os.replace(fresh, options.port_file)
    print(f"serving {server.world.name}, {options.envs} environment{'s' * (options.envs > 1)} per session, on {options.host}:{server.port}", flush=True)
    if server.world.multi_agent:
        shared = "; ".join(f"{behaviour.name}: {', '.join(behaviour.agents)}" for behaviour in server.world.behaviours)
        print(f"agents that share a policy (--group {options.group}): {shared}", flush=True)
    server.run()
    return 0
