"""A trainer of protocol 2 before worlds/weather.gd: sets the wind, and prints what it is told, a line for each step.
weather_client.py PORT"""
import sys

from consac.client import connect

with connect(f"tcp://127.0.0.1:{sys.argv[1]}", protocol=2) as connection:
    wind = connection.parameters["wind"]
    print("client: declared", wind.default, wind.low, wind.high, wind.description)
    print("client: groups", connection.groups)
    connection.set_parameters({"wind": 7})
    connection.reset()
    for step in range(6):
        if step == 1:
            connection.set_parameters({"wind": 2})
        connection.step()
        seen = [rows.observations[0].ravel().tolist() for rows in connection.rows]
        paid = [rows.rewards.tolist() for rows in connection.rows]
        print(f"client: step {step} sees {seen} paid {paid} group {connection.group_rewards.tolist()} told {connection.statistics}")
