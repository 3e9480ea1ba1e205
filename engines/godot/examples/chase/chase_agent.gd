class_name ChaseAgent
extends ConsacAgent
## One of a pair: a chaser, which is faster, or a runner, which has a place to run to. Each learns
## with all others of its behaviour; both move themselves, with no physics.

const ROOM := 5.0  # m from the middle to a wall
const CAUGHT := 0.4  # m
const TIME_STEP := 0.1  # s
const CHASER_SPEED := 2.0  # m/s
const RUNNER_SPEED := 1.6
const MOST_STEPS := 100

## Whether it chases or runs.
var chases := false
## The other one of the pair.
var other: ChaseAgent
## Where it is, in m from the middle.
var place := Vector2.ZERO


## One of a pair.
static func create(is_chaser: bool) -> ChaseAgent:
	var agent := ChaseAgent.new()
	agent.chases = is_chaser
	agent.behaviour = &"chaser" if is_chaser else &"runner"
	agent.observations = [ConsacEntry.box(&"place", 2), ConsacEntry.box(&"other", 2)]
	agent.actions = [ConsacEntry.box(&"move", 2)]
	agent.max_steps = MOST_STEPS
	return agent


func reset(_episode_seed: int) -> void:
	place = Vector2(rng.randf_range(-ROOM, ROOM), rng.randf_range(-ROOM, ROOM))


func observe(into: Dictionary) -> void:
	into[&"place"] = place / ROOM
	into[&"other"] = (other.place - place) / (2.0 * ROOM)


func act(chosen: Dictionary) -> void:
	var move: PackedFloat32Array = chosen[&"move"]
	var speed := CHASER_SPEED if chases else RUNNER_SPEED
	place += Vector2(move[0], move[1]).limit_length(1.0) * speed * TIME_STEP
	place = place.clampf(-ROOM, ROOM)


func judge() -> void:
	var caught := place.distance_to(other.place) < CAUGHT
	add_reward((10.0 if caught else -0.1) * (1.0 if chases else -1.0))
	if caught:
		end_episode()


func heuristic(into: Dictionary) -> void:
	var towards := (other.place - place).normalized()
	# A runner that only fled would end in a corner.
	into[&"move"] = towards if chases else (-towards - 0.8 * place / ROOM).limit_length(1.0)
