class_name ConsacBackend
extends RefCounted
## Who chooses the agents' actions: a trainer over the network, a model, the player.
##
## [ConsacSync] drives one:
## [codeblock]
## begin(agents)
## poll() until RESET; all agents begin an episode and look; offer()
## poll() until ACT; all agents act, the world moves, all are judged and look; offer()
## ... until DONE or FAILED, and then again from poll() until RESET
## [/codeblock]
## It never throws the world off its course: what goes wrong is one line in [member error]. The
## native extension's backend is made with its [ConsacSync] as the one argument, and reads the
## settings there.

## What [method poll] asks for.
enum Cue {
	WAIT,  ## nothing has come; ask again
	ACT,  ## the agents' [member ConsacAgent.action_row] is filled
	RESET,  ## a session begins: start all episodes from [member session_seed], then offer
	DONE,  ## the session ended as it should
	FAILED,  ## the session ended otherwise; [member error] says why
}

## Whether a session that ended as it should was a whole training; else a model was tried, or some steps of it.
var completed := true
## Why the latest session failed.
var error := ""
## What is to be said of a session that ended as it should, or "".
var note := ""
## From which the episodes' seeds of this session come.
var session_seed: int = 0
## What it does at the moment, for the label on the screen.
var state := "idle"


## Gets ready, with agents that are prepared. What does not fit, in one sentence, or "".
func begin(_agents: Array[ConsacAgent]) -> String:
	return ""


## The agents have looked: [member ConsacAgent.row], rewards and ends are those of the step that led
## here. Where an episode ended, [member ConsacAgent.final_row] is its last observation and
## [member ConsacAgent.row] the next one's first. A number that is not finite ends the session with
## what [method ConsacAgent.blame_for] says.
func offer() -> void:
	pass


## What is next, after waiting for it for [param _wait_s] seconds at most.
func poll(_wait_s: float) -> Cue:
	return Cue.WAIT


## What the first episode of agent [param _index] begins from; -1: from what [member session_seed]
## draws for it. Its later episodes follow from its first.
func seed_for(_index: int) -> int:
	return -1


## Writes what the episode of [param _agent] that begins now has of the world's parameters into [param _values], where
## they are what is usual.
func fill_parameters(_agent: ConsacAgent, _values: Dictionary) -> void:
	pass


## A number of the game's own for the log of who trains.
func tell(_metric: StringName, _value: float) -> void:
	pass


## An agent that is prepared has come; it takes part from the next [method offer] on. Why it cannot, in
## one sentence, or "".
func join(_agent: ConsacAgent) -> String:
	return "agents come and go with the native extension only; see engines/godot/README.md"


## Some agents are freed or no longer in the tree. Why that cannot be, or "".
func let_go() -> String:
	return "agents come and go with the native extension only; see engines/godot/README.md"


## [param agent] leaves as its episode ends: what its last step was worth is told now, for it may be gone when the others
## have seen, and no episode begins. Why that cannot be, or "".
func farewell(_agent: ConsacAgent) -> String:
	return let_go()


## Ends the session, because of [param why]; the next [method poll] says FAILED.
func refuse(why: String) -> void:
	error = why


## The game is paused, or goes on, by somebody else than [ConsacSync]; until it goes on nothing is
## offered.
func set_paused(_paused: bool) -> void:
	pass


## Whether Ctrl-C or SIGTERM has come while something was under way that wants to be saved.
func interrupted() -> bool:
	return false


## Saves what was learned so far, marked with [param step]. What is wrong, or "".
func checkpoint(_step: int) -> String:
	return ""


## How it goes, as ConsacWorld.progress() tells it; empty where there is none.
func progress() -> Dictionary:
	return {}


## Ends everything; can be called at any time, and again.
func close() -> void:
	pass
