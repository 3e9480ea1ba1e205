@icon("res://addons/consac/icon.svg")
class_name ConsacGoals
extends Resource
## What an agent with goals is paid. It observes two boxes of one size, [code]achieved_goal[/code] and
## [code]desired_goal[/code], as Gymnasium's environments with goals do, and what it is paid follows from their distance.
## So a learner can also learn from goals that were not meant: hindsight experience replay,
## [code]replay_buffer_class: HerReplayBuffer[/code] of dqn, sac, td3 and ddpg, inside the engine and over protocol 2.

## What a step pays, by the observation that it led to.
enum Pay {
	SPARSE,  ## 0 where the goal is reached, else -1
	DENSE,  ## minus the distance from it
}

## The entries that hold the goals.
const ACHIEVED := &"achieved_goal"
const DESIRED := &"desired_goal"

## What a step pays.
@export var pay := Pay.SPARSE
## SPARSE: so near, in the units of the entries, the goal is reached.
@export_range(0.0, 1000000.0, 0.001, "or_greater", "hide_slider") var threshold: float = 0.05
## The agent is paid by its goals alone, and [method ConsacAgent.add_reward] counts for nothing. Otherwise that pays, and is
## to come to the same.
@export var pays := true


## What is wrong with it for an agent of [param entries], in one sentence; "" when nothing is.
func fault(entries: Array[ConsacEntry]) -> String:
	var found := {}
	for entry in entries:
		if entry.name in [ACHIEVED, DESIRED]:
			found[entry.name] = entry
	for goal: StringName in [ACHIEVED, DESIRED]:
		if not found.has(goal):
			return "goals: there is no observation '%s'; add a box of that name" % goal
		if found[goal].kind != ConsacEntry.Kind.BOX:
			return "goals: the observation '%s' is no box; its distance could not be told" % goal
	var one: ConsacEntry = found[ACHIEVED]
	var other: ConsacEntry = found[DESIRED]
	if one.size != other.size or one.low != other.low or one.high != other.high:
		return "goals: 'achieved_goal' and 'desired_goal' differ in size, low or high; make them alike"
	if not (threshold >= 0.0 and is_finite(threshold)):
		return "goals: threshold is %s; give a distance of 0 or more" % threshold
	return ""


## Where the numbers of achieved and desired goal begin in a row of [param entries], and how many there are.
static func places(entries: Array[ConsacEntry]) -> PackedInt32Array:
	var found := PackedInt32Array([0, 0, 0])
	var at := 0
	for entry in entries:
		if entry.name in [ACHIEVED, DESIRED]:
			found[0 if entry.name == ACHIEVED else 1] = at
			found[2] = entry.numbers()
		at += entry.numbers()
	return found


## What a step pays that led to [param row], whose goals are at [param at].
func worth(row: PackedFloat32Array, at: PackedInt32Array) -> float:
	var squares := 0.0
	for i in at[2]:
		var apart := row[at[1] + i] - row[at[0] + i]
		squares += apart * apart
	var distance := PackedFloat32Array([sqrt(squares), threshold])  # of the precision of what a learner is told
	if pay == Pay.DENSE:
		return -distance[0]
	return 0.0 if distance[0] <= distance[1] else -1.0


## As the native classes take it.
func table() -> Dictionary:
	return {reward = "dense" if pay == Pay.DENSE else "sparse", threshold = threshold, pays = pays}
