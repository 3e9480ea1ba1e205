// Copyright CONSAC authors. MIT License.
#include "ConsacModel.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacModelState.h"
#include "Templates/PimplPtr.h"

namespace ConsacPlugin
{

static consac::Status NoModel()
{
	return consac::Status(consac::StatusCode::kFailedPrecondition, "there is no model yet; an asset is one, Load Model gives one");
}

// Acts for so many rows; the actions are in State.Actions.
static consac::Status ActFor(FConsacModelState& State, const TArray<float>& Values, int64 Rows, bool bDeterministic)
{
	const consac::Layout& Seen = State.Policy->observation_layout();
	const std::size_t SeenBytes = Seen.row_bytes;
	const int64 Count = CountOf(Seen);
	CONSAC_RETURN_IF_ERROR(State.Policy->MakeRoom(Rows));
	if (State.Begins.size() < static_cast<std::size_t>(Rows))
	{
		State.Begins.resize(static_cast<std::size_t>(Rows), 1);
	}
	State.Observations.assign(static_cast<std::size_t>(Rows) * SeenBytes, std::byte{0});
	State.Actions.resize(static_cast<std::size_t>(Rows) * State.Policy->action_layout().row_bytes);
	const consac::Layout& Layout = State.Policy->observation_layout();
	for (int64 Row = 0; Row < Rows; ++Row)
	{
		CONSAC_RETURN_IF_ERROR(WriteRow(Layout, State.Observations.data() + static_cast<std::size_t>(Row) * SeenBytes, Values.GetData() + Row * Count, Count));
	}
	consac::ActRows Acting;
	Acting.observations = State.Observations.data();
	Acting.rows = Rows;
	Acting.begins = State.Begins.data();
	State.Policy->Act(Acting, bDeterministic ? consac::ActionMode::kDeterministic : consac::ActionMode::kSample, State.Rng, State.Actions.data());
	std::fill_n(State.Begins.begin(), static_cast<std::size_t>(Rows), std::uint8_t{0});
	return consac::Status::Ok();
}

// An entry of a space each.
static TArray<FString> EntriesOf(const consac::Layout& Layout)
{
	TArray<FString> Entries;
	for (const consac::Leaf& Leaf : Layout.leaves)
	{
		Entries.Add(FromUtf8(Leaf.name.empty() ? Leaf.space.ToString() : Leaf.name + ": " + Leaf.space.ToString()));
	}
	return Entries;
}

}

UConsacModel::UConsacModel()
	: State(MakePimpl<FConsacModelState>())
{
}

FConsacModelState* UConsacModel::GetState() const
{
	if (!State->Policy && !File.IsEmpty() && !std::exchange(State->bTried, true))
	{
		consac::Result<consac::Policy> Policy = consac::Policy::FromBytes(ConsacPlugin::BytesOf(File), 1);
		if (Policy.ok())
		{
			State->Policy.emplace(std::move(*Policy));
		}
		else
		{
			ConsacPlugin::LogError(FString::Printf(TEXT("the model %s: %s"), *GetName(), *ConsacPlugin::FromUtf8(Policy.status().message())));
		}
	}
	return State->Policy ? State.Get() : nullptr;
}

const TArray<uint8>& UConsacModel::GetFile() const
{
	return File;
}

bool UConsacModel::Load(const FString& Path, FString& Error)
{
	consac::Result<std::vector<std::byte>> Bytes = consac::ReadFile(ConsacPlugin::ToFile(Path));
	if (!Bytes.ok())
	{
		return ConsacPlugin::Explain(Bytes.status(), Error);
	}
	consac::Result<consac::Policy> Policy = consac::Policy::FromBytes(*Bytes, 1);
	if (Policy.ok() && Bytes->size() > static_cast<std::size_t>(std::numeric_limits<int32>::max()))
	{
		return ConsacPlugin::Explain(consac::Status(consac::StatusCode::kResourceExhausted, "the model is larger than 2 GiB, which no asset can be"), Error);
	}
	if (!Policy.ok())
	{
		return ConsacPlugin::Explain(Policy.status(), Error);
	}
	File.SetNumUninitialized(static_cast<int32>(Bytes->size()));
	std::memcpy(File.GetData(), Bytes->data(), Bytes->size());
	State->Policy.emplace(std::move(*Policy));
	State->Begins.clear();
	Describe();
	return ConsacPlugin::Explain(consac::Status::Ok(), Error);
}

void UConsacModel::TakeOver(UConsacModel& Loaded)
{
	File = Loaded.File;
	State->Policy.emplace(std::move(*Loaded.State->Policy));
	Loaded.State->Policy.reset();
	State->Begins.clear();
	Describe();
}

// For the Details panel, which shows what is saved.
void UConsacModel::Describe()
{
	const consac::PolicyData& Data = State->Policy->data();
	const consac::TrainingFacts Facts = consac::FactsOf(Data.training_json);
	Behaviour = ConsacPlugin::FromUtf8(Data.behaviour);
	Sees = ConsacPlugin::EntriesOf(State->Policy->observation_layout());
	Does = ConsacPlugin::EntriesOf(State->Policy->action_layout());
	ObservationSize = ConsacPlugin::CountOf(State->Policy->observation_layout());
	ActionSize = ConsacPlugin::CountOf(State->Policy->action_layout());
	Algorithm = ConsacPlugin::FromUtf8(Facts.algorithm);
	TrainedSteps = Facts.steps;
	Parameters = static_cast<int64>(Data.parameters.size());
	bRemembers = State->Policy->recurrent();
}

void UConsacModel::Predict(const TArray<float>& Observation, bool bDeterministic, EConsacResult& Result, FConsacAction& Action, FString& Error)
{
	Action = FConsacAction();
	consac::Status Status = ConsacPlugin::NoModel();
	if (GetState() != nullptr)
	{
		const int64 Wanted = GetObservationSize();
		Status = Observation.Num() == Wanted ? ConsacPlugin::ActFor(*State, Observation, 1, bDeterministic)
			: consac::Status(consac::StatusCode::kInvalidArgument, "the observation has " + std::to_string(Observation.Num()) + " numbers; the model sees " + std::to_string(Wanted));
	}
	if (ConsacPlugin::Answer(Status, Result, Error))
	{
		Action = ConsacPlugin::ToAction(State->Policy->action_layout(), State->Actions.data());
	}
}

namespace ConsacPlugin
{

// A name as an FName has it, which does not know capitals from small letters.
static std::string Folded(const FString& Name)
{
	return ToUtf8(Name.ToLower());
}

static std::string Folded(const consac::Leaf& Leaf)
{
	return Folded(FromUtf8(Leaf.name));
}

// The one row of a leaf; the error says what is wrong with the list.
static consac::Result<const FConsacNumbers*> RowOf(const consac::Leaf& Leaf, const consac::Layout& Layout, const TArray<FConsacNumbers>& Rows)
{
	const std::string Wanted = Folded(Leaf);
	if (std::count_if(Layout.leaves.begin(), Layout.leaves.end(), [&Wanted](const consac::Leaf& Other) { return Folded(Other) == Wanted; }) > 1)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, "the model sees several entries '" + Wanted + "' that capitals alone tell apart, which names here do not; give it their numbers with Predict");
	}
	const FConsacNumbers* Found = nullptr;
	for (const FConsacNumbers& Row : Rows)
	{
		if (Leaf.name.empty() || Folded(Row.Name.ToString()) == Wanted)
		{
			if (Found != nullptr)
			{
				return consac::Status(consac::StatusCode::kInvalidArgument, Leaf.name.empty() ? "the model sees one entry alone, and several are given" : "entry '" + Leaf.name + "' is given twice");
			}
			Found = &Row;
		}
	}
	if (Found == nullptr)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, Leaf.name.empty() ? "no entry is given" : "entry '" + Leaf.name + "' is missing");
	}
	if (Found->Values.Num() != Leaf.count)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, "entry '" + Folded(Found->Name.ToString()) + "' has " + std::to_string(Found->Values.Num()) +
			" numbers; the model sees " + std::to_string(Leaf.count));
	}
	if (Rows.Num() != static_cast<int32>(Layout.leaves.size()))
	{
		for (const FConsacNumbers& Row : Rows)
		{
			const std::string Name = Folded(Row.Name.ToString());
			if (std::none_of(Layout.leaves.begin(), Layout.leaves.end(), [&Name](const consac::Leaf& Other) { return Folded(Other) == Name; }))
			{
				return consac::Status(consac::StatusCode::kNotFound, "the model sees no entry '" + Name + "'");
			}
		}
	}
	return Found;
}

}

void UConsacModel::PredictByNames(const TArray<FConsacNumbers>& Observations, bool bDeterministic, EConsacResult& Result, TArray<FConsacNumbers>& Actions, FString& Error)
{
	const TArray<FConsacNumbers> Given = Observations; // a node may be given one list as its input and its output
	Actions.Reset();
	consac::Status Status = GetState() != nullptr ? consac::Status::Ok() : ConsacPlugin::NoModel();
	TArray<float> Numbers;
	if (GetState() != nullptr)
	{
		const consac::Layout& Layout = State->Policy->observation_layout();
		for (const consac::Leaf& Leaf : Layout.leaves)
		{
			const consac::Result<const FConsacNumbers*> Row = Status.ok() ? ConsacPlugin::RowOf(Leaf, Layout, Given) : consac::Result<const FConsacNumbers*>(Status);
			Status = Row.status();
			if (Status.ok())
			{
				Numbers.Append((*Row)->Values);
			}
		}
	}
	Status = Status.ok() ? ConsacPlugin::ActFor(*State, Numbers, 1, bDeterministic) : Status;
	if (ConsacPlugin::Answer(Status, Result, Error))
	{
		for (const consac::Leaf& Leaf : State->Policy->action_layout().leaves)
		{
			FConsacNumbers Row;
			Row.Name = Leaf.name.empty() ? FName(TEXT("action")) : FName(*ConsacPlugin::FromUtf8(Leaf.name));
			ConsacPlugin::ReadLeaf(Leaf, State->Actions.data(), Row.Values);
			Actions.Add(Row);
		}
	}
}

void UConsacModel::PredictMany(const TArray<float>& Observations, bool bDeterministic, EConsacResult& Result, TArray<float>& Actions, FString& Error)
{
	// A node may be given one list as its input and its output.
	const TArray<float> Given = Observations;
	Actions.Reset();
	consac::Status Status = ConsacPlugin::NoModel();
	const int64 Size = GetObservationSize();
	const int64 Rows = Size > 0 ? Given.Num() / Size : 0;
	if (GetState() != nullptr)
	{
		Status = Rows * Size == Given.Num() ? consac::Status::Ok()
			: consac::Status(consac::StatusCode::kInvalidArgument, std::to_string(Given.Num()) + " numbers are no whole number of observations of " + std::to_string(Size));
		if (Status.ok() && Rows > 0)
		{
			Status = ConsacPlugin::ActFor(*State, Given, Rows, bDeterministic);
		}
	}
	if (ConsacPlugin::Answer(Status, Result, Error))
	{
		const consac::Layout& Layout = State->Policy->action_layout();
		Actions.Reserve(static_cast<int32>(Rows) * GetActionSize());
		for (int64 Row = 0; Row < Rows; ++Row)
		{
			for (const consac::Leaf& Leaf : Layout.leaves)
			{
				ConsacPlugin::ReadLeaf(Leaf, State->Actions.data() + static_cast<std::size_t>(Row) * Layout.row_bytes, Actions);
			}
		}
	}
}

void UConsacModel::BeginModelEpisode(int32 Agent)
{
	for (std::size_t Row = 0; Row < State->Begins.size(); ++Row)
	{
		if (Agent < 0 || Row == static_cast<std::size_t>(Agent))
		{
			State->Begins[Row] = 1;
		}
	}
}

void UConsacModel::CheckModelSpaces(const FConsacSpace& ObservationSpace, const FConsacSpace& ActionSpace, EConsacResult& Result, FString& Error)
{
	const consac::Result<consac::Space> Seen = ConsacPlugin::ToSpace(ObservationSpace);
	const consac::Result<consac::Space> Done = ConsacPlugin::ToSpace(ActionSpace);
	consac::Status Status = GetState() == nullptr ? ConsacPlugin::NoModel() : !Seen.ok() ? Seen.status() : Done.status();
	if (Status.ok())
	{
		Status = State->Policy->Fits(consac::BehaviourSpec::Of(State->Policy->data().behaviour, *Seen, *Done, 1));
	}
	ConsacPlugin::Answer(Status, Result, Error);
}

int32 UConsacModel::GetObservationSize() const
{
	return GetState() != nullptr ? ConsacPlugin::CountOf(State->Policy->observation_layout()) : 0;
}

int32 UConsacModel::GetActionSize() const
{
	return GetState() != nullptr ? ConsacPlugin::CountOf(State->Policy->action_layout()) : 0;
}

FString UConsacModel::DescribeModel() const
{
	if (GetState() == nullptr)
	{
		return TEXT("no model");
	}
	const consac::PolicyData& Data = State->Policy->data();
	return ConsacPlugin::FromUtf8(Data.behaviour + ": sees " + Data.observation_space.ToString() + ", does " + Data.action_space.ToString() + ", " +
		std::to_string(Data.parameters.size()) + " parameters");
}

void UConsacModel::BeginDestroy()
{
	if (State.IsValid()) // a temporary object of Hot Reload has none
	{
		State->Policy.reset();
	}
	Super::BeginDestroy();
}
