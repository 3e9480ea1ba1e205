class_name ConsacReport
extends RefCounted
## Counts what a session brings and tells people: a line now and then, a file to draw curves of, the editor's dock.

const LATEST := 100  # episodes, of the means
const OWN: Array[StringName] = [&"steps", &"seconds", &"steps_per_s", &"episodes", &"mean_episode_reward",
		&"mean_episode_length", &"updates"]  # numbers that a game's cannot be called
const SHORT_IN_A_ROW := 20  # episodes of one step after which something is likely wrong

## Rewards and lengths of the latest episodes.
var episode_rewards := PackedFloat32Array()
var episode_lengths := PackedInt32Array()
## Episodes that have ended.
var episodes: int = 0

var _began_usec := 0
var _told_usec := 0
var _told_steps := 0
var _sums := {}  # of the game's own metrics since the latest line: [sum, count]
var _of_behaviours := {}  # name: rewards of its latest episodes
var _refused := {}  # names of which was told
var _short := 0  # episodes of one step in a row
var _warned := false
var _curve: FileAccess


## A session begins. [param path]: where the curve's file goes, "" for nowhere. What is wrong, or "".
func begin(path := "") -> String:
	episode_rewards.clear()
	episode_lengths.clear()
	_of_behaviours.clear()
	episodes = 0
	_sums.clear()
	_began_usec = Time.get_ticks_usec()
	_told_usec = _began_usec
	_told_steps = 0
	_curve = null
	if path.is_empty():
		return ""
	_curve = FileAccess.open(path, FileAccess.WRITE)
	if _curve == null:
		return "the curve '%s' cannot be written: %s" % [path, error_string(FileAccess.get_open_error())]
	_curve.store_line("steps,name,value")
	return ""


## An episode is over.
func note_episode(agent: ConsacAgent) -> void:
	if episode_lengths.size() >= LATEST:
		episode_lengths.remove_at(0)
	_keep_latest(episode_rewards, agent.total_reward)
	_keep_latest(_of_behaviours.get_or_add(agent.behaviour, PackedFloat32Array()), agent.total_reward)
	episode_lengths.append(agent.steps)
	episodes += 1
	_short = _short + 1 if agent.steps == 1 and agent.max_steps != 1 else 0
	if _short == SHORT_IN_A_ROW and not _warned:
		_warned = true
		push_warning(("%d episodes in a row ended with their first step (the latest of %s): does reset() put back all that "
				+ "judge() looks at? Rigid bodies are placed with ConsacBodies.place_2d() and place_3d()")
				% [SHORT_IN_A_ROW, agent.path_in_world()])


## A number of the game's own; what a line tells is the mean since the line before. Whether it is one that can be told.
func note_metric(name: StringName, value: float) -> bool:
	if name in OWN or name.is_empty() or name.contains("\n") or not is_finite(value):
		_refuse(name, value)
		return false
	var sum: Array = _sums.get_or_add(name, [0.0, 0])
	sum[0] += value
	sum[1] += 1
	return true


# Once for each name.
func _refuse(name: StringName, value: float) -> void:
	if _refused.has(name):
		return
	_refused[name] = true
	if not is_finite(value):
		printerr("consac: note(): '%s' is %s and is left out; mend where it comes from" % [name, value])
	else:
		printerr("consac: note(): '%s' %s; choose another name" % [
				name.c_escape(), "is a number of the sync's own" if name in OWN else "is no name of one line"])


## Whether [param every_s] seconds have passed since the latest call of [method tell].
func is_due(every_s: float) -> bool:
	return every_s > 0.0 and Time.get_ticks_usec() - _told_usec >= every_s * 1e6


## How things stand after so many [param steps], as numbers by name, [param more] among them; also the next row of the
## curve.
func tell(steps: int, more := {}) -> Dictionary:
	var now := Time.get_ticks_usec()
	var numbers := {
		steps = steps,
		seconds = (now - _began_usec) / 1e6,
		steps_per_s = (steps - _told_steps) / maxf(1e-6, (now - _told_usec) / 1e6),
		episodes = episodes,
	}
	if episodes > 0:
		numbers.mean_episode_reward = mean_episode_reward()
		numbers.mean_episode_length = _mean_length()
	if _of_behaviours.size() > 1:
		for behaviour: StringName in _of_behaviours:
			var rewards: PackedFloat32Array = _of_behaviours[behaviour]
			numbers["mean_episode_reward " + behaviour] = _mean(rewards, rewards.size())
	numbers.merge(more)
	for name: StringName in _sums:
		numbers[String(name)] = _sums[name][0] / _sums[name][1]
	_sums.clear()
	_told_usec = now
	_told_steps = steps
	if _curve != null:
		for name: String in numbers:
			if name != "steps":
				_curve.store_line("%d,%s,%s" % [steps, name.c_escape().replace(",", ";"), var_to_str(numbers[name])])
		_curve.flush()
	return numbers


## The line of [param numbers], which [method tell] gave.
static func line_of(numbers: Dictionary, total_steps: int) -> String:
	var parts := PackedStringArray([
		"%d of %d steps" % [numbers.steps, total_steps] if total_steps > 0 else "%d steps" % numbers.steps,
		"%.0f steps/s" % numbers.steps_per_s])
	for name: String in numbers:
		if not name in ["steps", "seconds", "steps_per_s"]:
			var value: Variant = numbers[name]
			parts.append("%s %s" % [name.replace("_", " "), value if value is int else String.num(value, 3)])
	return ", ".join(parts)


## What the session was, at its end; [param rewards]: a place for each of the latest steps, of which there were [param steps].
func summary(steps: int, rewards: PackedFloat32Array) -> String:
	var seconds := maxf(1e-6, (Time.get_ticks_usec() - _began_usec) / 1e6)
	var kept := mini(steps, rewards.size())
	return "%d steps in %.2f s (%.0f steps/s), mean reward of the last %d steps %.3f, of the last %d episodes %.2f%s" % [
			steps, seconds, steps / seconds, kept, _mean(rewards, kept), episode_rewards.size(), mean_episode_reward(),
			" (none has ended: call end_episode(), or set max_steps)" if steps > 0 and episode_rewards.is_empty() else ""]


## Of the latest episodes.
func mean_episode_reward() -> float:
	return _mean(episode_rewards, episode_rewards.size())


static func _keep_latest(rewards: PackedFloat32Array, reward: float) -> void:
	if rewards.size() >= LATEST:
		rewards.remove_at(0)
	rewards.append(reward)


func _mean_length() -> float:
	var sum := 0
	for length in episode_lengths:
		sum += length
	return float(sum) / maxi(1, episode_lengths.size())


static func _mean(values: PackedFloat32Array, count: int) -> float:
	var sum := 0.0
	for i in count:
		sum += values[i]
	return sum / count if count > 0 else 0.0
