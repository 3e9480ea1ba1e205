// CONSAC for games in C#: the add-on's nodes stay what they are (GDScript and the native extension), these classes speak
// with them. C# cannot extend a GDScript class, so an agent in C# is a node below a ConsacAgent:
//
//   Agent          ConsacAgent; its entries are set in the inspector
//     Brain        a script that extends Consac.AgentBehaviour
//
// Needs Godot with .NET. Compiled against stand-ins for the engine's classes, not run in a Godot with .NET.
using Godot;
using Godot.Collections;

namespace Consac
{
    /// <summary>What the ConsacAgent above it observes, does, earns.</summary>
    public abstract partial class AgentBehaviour : Node
    {
        /// <summary>The ConsacAgent.</summary>
        protected Node Agent { get; private set; }
        /// <summary>Random numbers of this episode, the same for the same seed.</summary>
        protected RandomNumberGenerator Rng => (RandomNumberGenerator)Agent.Get("rng").AsGodotObject();
        /// <summary>Decisions of this episode so far.</summary>
        public int Steps => Agent.Get("steps").AsInt32();
        /// <summary>Reward of this episode so far.</summary>
        public float TotalReward => Agent.Get("total_reward").AsSingle();

        public override void _EnterTree()
        {
            if (Agent == GetParent()) return;  // it was here before: the agent itself has moved
            Agent = GetParent();
            Agent.Connect("resetting", Callable.From<long>(Reset));
            Agent.Connect("observing", Callable.From<Dictionary>(Observe));
            Agent.Connect("acting", Callable.From<Dictionary>(Act));
            Agent.Connect("judging", Callable.From(Judge));
            Agent.Connect("masking", Callable.From<Dictionary>(Mask));
            Agent.Connect("playing", Callable.From<Dictionary>(Heuristic));
        }

        /// <summary>Puts the world where an episode begins; random numbers come from Rng.</summary>
        protected abstract void Reset(long episodeSeed);
        /// <summary>One value for each observation entry: into["place"] = 3.0f.</summary>
        protected abstract void Observe(Dictionary into);
        /// <summary>Does what is chosen: an int for a discrete entry, a float for a box of size 1, else a float[].</summary>
        protected abstract void Act(Dictionary chosen);
        /// <summary>AddReward and EndEpisode for what happened since Act.</summary>
        protected abstract void Judge();
        /// <summary>Where masks_actions is set: a byte[] for each discrete entry, 0 where a choice is not legal. C# gets a copy
        /// of it: change that and put it back, legal["jump"] = bytes.</summary>
        protected virtual void Mask(Dictionary legal) { }
        /// <summary>What a person, or a rule, does: one value for each action entry.</summary>
        protected virtual void Heuristic(Dictionary into) { }

        /// <summary>Adds to the reward of the present step.</summary>
        protected void AddReward(float amount) => Agent.Call("add_reward", amount);
        /// <summary>Ends the episode; cutOff: there would have been more to earn.</summary>
        protected void EndEpisode(bool cutOff = false) => Agent.Call("end_episode", cutOff);
        /// <summary>Adds to the reward of every agent of the ConsacAgent's group.</summary>
        protected void AddGroupReward(float amount) => Agent.Call("add_group_reward", amount);
        /// <summary>What this episode has of one of the ConsacSync's parameters.</summary>
        protected float Parameter(string name) => Agent.Call("parameter", name).AsSingle();
        /// <summary>A number for people to see, with the rewards.</summary>
        protected void Note(string metric, float value) => Agent.Call("note", metric, value);
    }

    /// <summary>Puts rigid bodies where an episode begins.</summary>
    public static class Bodies
    {
        private static GodotObject Script => GD.Load<GDScript>("res://addons/consac/consac_bodies.gd");

        /// <summary>Place, velocity (pixels a second) and turn (radians a second) of a body.</summary>
        public static void Place2D(RigidBody2D body, Transform2D where, Vector2 velocity = default(Vector2), float turn = 0)
            => Script.Call("place_2d", body, where, velocity, turn);
        /// <summary>Place, velocity (metres a second) and turn (radians a second) of a body.</summary>
        public static void Place3D(RigidBody3D body, Transform3D where, Vector3 velocity = default(Vector3),
                                   Vector3 turn = default(Vector3))
            => Script.Call("place_3d", body, where, velocity, turn);
    }

    /// <summary>A ConsacSync.</summary>
    public class Sync
    {
        private readonly Node _node;
        public Sync(Node consacSync) { _node = consacSync; }

        /// <summary>What it does at the moment, in a few words.</summary>
        public string State => _node.Call("state").AsString();
        /// <summary>Decisions of this session, of all agents that count.</summary>
        public int Steps => _node.Get("steps").AsInt32();
        /// <summary>Of the latest 100 episodes.</summary>
        public float MeanEpisodeReward => _node.Call("mean_episode_reward").AsSingle();
        /// <summary>Ends the session and puts everything back that was changed.</summary>
        public void Stop() => _node.Call("stop");
        /// <summary>Every few seconds while something learns: numbers by name.</summary>
        public void OnProgress(System.Action<Dictionary> told) => _node.Connect("progressed", Callable.From(told));
        /// <summary>A session is over; "" when it ended as it should.</summary>
        public void OnSessionEnded(System.Action<string> told) => _node.Connect("session_ended", Callable.From(told));
    }

    /// <summary>A trained model that a script asks itself.</summary>
    public class Model
    {
        private readonly GodotObject _model = ClassDB.Instantiate("ConsacModel").AsGodotObject();

        /// <summary>Reads a file; what is wrong, or "".</summary>
        public string Load(string path) => _model.Call("load", path).AsString();
        /// <summary>Why the latest call failed; "" where it went well.</summary>
        public string LastError => _model.Call("last_error").AsString();
        /// <summary>Its entries and how it was trained.</summary>
        public Dictionary Describe() => _model.Call("describe").AsGodotDictionary();
        /// <summary>Actions by name for observations by name, row after row: {"place": new float[] {1, 2}}.</summary>
        public Dictionary PredictNamed(Dictionary observations)
            => _model.Call("predict_named", observations).AsGodotDictionary();
        /// <summary>For models that remember: the agent of this row begins an episode; below 0: all do.</summary>
        public void BeginEpisode(int row) => _model.Call("begin_episode", row);
    }
}
