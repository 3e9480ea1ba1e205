#!/usr/bin/env bash
# Every speed table, one after another on a quiet machine: CONSAC's own, beside LibTorch, beside Stable Baselines3.
# Writes unreal_tick.md, godot.md and untuned_worlds.md of bench/results, and build/speed.md: bench/results/speed.md holds several machines
# and peers that are not here, so its tables are taken over by hand. Needs `tools/setup.sh bench` first (make bench does that).
set -euo pipefail
cd "$(dirname "$0")/.."
cmake --preset release -DCONSAC_BENCH_LIBTORCH=ON --log-level=WARNING
cmake --build --preset release -j "$(nproc)"
consac=build/release/cli/consac
python=.venv/bin/python
out=build/speed.md
{
  echo "# Speed"
  echo
  echo "Written by \`make bench\` on $(date -u +%Y-%m-%d), commit $(git rev-parse --short HEAD). Ratios are within one run on one machine."
  printf '\n## CONSAC\n\n'; $consac bench
  printf '\n## PPO update beside LibTorch, same run\n\n```\n'; build/release/bench/consac_ppo_update_bench; echo '```'
  printf '\n## The nature CNN beside PyTorch, in turn\n\n'; $python bench/compare/cnn_speed.py build/release/bench/consac_cnn_bench
  printf '\n## SAC beside a loop of PyTorch, in turn\n\n'; $python bench/compare/sac_torch.py $consac
  printf '\n## One action\n\n```\n'; build/release/bench/consac_action_bench; echo '```'
  printf '\n## Checkpoints of a replay\n\n'; build/release/bench/consac_checkpoint_bench
  printf '\n## Transports\n\n'; build/release/bench/consac_transport_bench; echo
  PYTHONPATH=python $python bench/compare/python_client_bench.py $consac
  printf '\n## Beside Stable Baselines3, in turn\n\n'; $python bench/compare/sb3_speed.py $consac
} | tee "$out"
{
  echo "# What the Unreal plugin costs a tick"
  echo
  echo "Written by \`make bench\` on $(date -u +%Y-%m-%d), commit $(git rev-parse --short HEAD), in the shim that stands for Unreal: events and arrays are its own."
  echo; build/release/engines/unreal/engine_bench
} | tee bench/results/unreal_tick.md
tools/setup.sh godot && CONSAC_BUILD_DIR=$PWD/build/release $python bench/godot_bench.py
$python bench/compare/sb3_learn.py $consac point-v0 maze-v0 reach3-v0 | tee bench/results/untuned_worlds.md
