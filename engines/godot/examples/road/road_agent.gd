class_name RoadAgent
extends ConsacAgent
## The worked example of the thesis: an actor on a road from 0 to 40 learns to walk to a coin. The
## same world as CONSAC's built-in road-v0: reward 1 for a step that comes nearer, leaving the road
## ends the episode.

const FIRST := 0
const LAST := 40
const START := 10
const COIN_MOVES := 50  # steps after which the coin moves by itself

## Where the actor stands.
var actor := START
## Where the coin lies.
var coin := LAST

var _since_coin := 0
var _started := false
var _before := 0


func reset(_episode_seed: int) -> void:
	actor = rng.randi_range(FIRST, LAST) if _started else START
	_started = true
	_place_coin()


func observe(into: Dictionary) -> void:
	into[&"actor"] = actor
	into[&"coin"] = coin


func act(chosen: Dictionary) -> void:
	_before = absi(coin - actor)
	actor += chosen[&"move"] - 1


func judge() -> void:
	if absi(coin - actor) < _before:
		add_reward(1.0)
	if actor < FIRST or actor > LAST:
		end_episode()
		actor = clampi(actor, FIRST, LAST)
	_since_coin += 1
	if actor == coin or _since_coin >= COIN_MOVES:
		_place_coin()


func heuristic(into: Dictionary) -> void:
	var keys := int(Input.get_axis(&"ui_left", &"ui_right"))
	into[&"move"] = 1 + (keys if keys != 0 else signi(coin - actor))


# Anywhere but where the actor stands: there it would be collected before it was seen.
func _place_coin() -> void:
	coin = rng.randi_range(FIRST, LAST - 1)
	coin += 1 if coin >= actor else 0
	_since_coin = 0
