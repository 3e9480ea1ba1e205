// Copyright CONSAC authors. MIT License.
#include "ConsacConvert.h"

#include "ConsacLog.h"
#include "Containers/StringConv.h"
#include "Containers/StringView.h"
#include "HAL/FileManager.h"
#include "Misc/Paths.h"

namespace ConsacPlugin
{

std::span<const std::byte> BytesOf(const TArray<uint8>& Bytes)
{
	return { reinterpret_cast<const std::byte*>(Bytes.GetData()), static_cast<std::size_t>(Bytes.Num()) };
}

std::string ToUtf8(const FString& Text)
{
	const FTCHARToUTF8 Converted(*Text);
	return std::string(Converted.Get(), static_cast<std::size_t>(Converted.Length()));
}

std::string ToFile(const FString& Path)
{
	const std::string Text = ToUtf8(Path);
	const bool bFromRoot = !Text.empty() && (Text[0] == '/' || Text[0] == '\\' || (Text.size() > 1 && Text[1] == ':'));
	if (Text.empty() || bFromRoot)
	{
		return Text;
	}
	return ToUtf8(FPaths::Combine(FPaths::ConvertRelativePathToFull(FPaths::ProjectSavedDir()), TEXT("Consac"), Path));
}

// Writing into it says what is wrong. By the engine: whether it compiles with char8_t, which the standard's own paths want in
// UTF-8, is not said.
static void MakeFolder(std::string_view Folder)
{
	IFileManager::Get().MakeDirectory(*FromUtf8(Folder), true);
}

std::string ToFolder(const FString& Path)
{
	const std::string Folder = ToFile(Path);
	MakeFolder(Folder);
	return Folder;
}

std::string ToFolderOrNone(const FString& Path)
{
	return Path.IsEmpty() ? std::string() : ToFolder(Path);
}

double ToSeconds(float Property)
{
	return std::isfinite(Property) ? std::clamp(static_cast<double>(Property), 0.0, 60.0) : 0.0;
}

std::string ToNewFile(const FString& Path)
{
	const std::string File = ToFile(Path);
	const std::size_t Slash = File.find_last_of("/\\");
	if (Slash != std::string::npos)
	{
		MakeFolder(std::string_view(File).substr(0, Slash));
	}
	return File;
}

FString FromUtf8(std::string_view Text)
{
	const FUTF8ToTCHAR Converted(Text.data(), static_cast<int32>(Text.size()));
	return FString(FStringView(Converted.Get(), Converted.Length()));
}

static std::string Counted(const char* What, int64 Has, int64 Wants)
{
	return std::string(What) + " has " + std::to_string(Has) + " numbers; it takes " + std::to_string(Wants);
}

// One bound for each number: as given, or the one that was given for all, or none.
static consac::Result<std::vector<double>> ToBounds(const char* What, const TArray<float>& Given, int32 Size, double Open)
{
	const int32 Number = Given.Num();
	if (Number > 1 && Number != Size)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument,
			std::string("the box has ") + std::to_string(Size) + " numbers and " + std::to_string(Number) + " " + What + "; give one for all, one for each, or none");
	}
	std::vector<double> Bounds(static_cast<std::size_t>(Size), Number == 0 ? Open : static_cast<double>(Given[0]));
	for (int32 Index = 0; Number > 1 && Index < Size; ++Index)
	{
		Bounds[static_cast<std::size_t>(Index)] = static_cast<double>(Given[Index]);
	}
	return Bounds;
}

static consac::Result<consac::Space> ToBox(const FConsacSpace& Space)
{
	constexpr int32 Largest = 1 << 24;
	if (Space.Size < 1 || Space.Size > Largest)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument,
			"a box has " + std::to_string(Space.Size) + " numbers; it takes 1 to " + std::to_string(Largest));
	}
	std::vector<int64_t> Shape;
	int64_t Product = 1;
	for (int32 Extent : Space.Shape)
	{
		Shape.push_back(Extent);
		Product = Extent > 0 && Product <= Largest ? Product * Extent : 0;
	}
	if (Shape.empty())
	{
		Shape.push_back(Space.Size);
		Product = Space.Size;
	}
	if (Product != Space.Size)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument,
			"the shape of the box has another number of elements than its size, " + std::to_string(Space.Size));
	}
	const double Infinity = std::numeric_limits<double>::infinity();
	consac::Result<std::vector<double>> Low = ToBounds("lower bounds", Space.Low, Space.Size, Space.bBytes ? 0.0 : -Infinity);
	consac::Result<std::vector<double>> High = ToBounds("upper bounds", Space.High, Space.Size, Space.bBytes ? 255.0 : Infinity);
	if (!Low.ok() || !High.ok())
	{
		return Low.ok() ? High.status() : Low.status();
	}
	return consac::Space::Box(std::move(*Low), std::move(*High), std::move(Shape), Space.bBytes ? consac::DType::kU8 : consac::DType::kF32);
}

consac::Result<consac::Space> ToSpace(const FConsacSpace& Space)
{
	std::vector<int64_t> Choices;
	switch (Space.Kind)
	{
	case EConsacSpaceKind::Box:
		return ToBox(Space);
	case EConsacSpaceKind::Discrete:
		return consac::Space::Discrete(Space.Size);
	case EConsacSpaceKind::MultiDiscrete:
		for (int32 Choice : Space.Choices)
		{
			Choices.push_back(Choice);
		}
		return consac::Space::MultiDiscrete(std::move(Choices));
	case EConsacSpaceKind::MultiBinary:
		return consac::Space::MultiBinary(Space.Size);
	}
	return consac::Status(consac::StatusCode::kInvalidArgument, "a space of no known kind");
}

bool Explain(const consac::Status& Status, FString& Error)
{
	Error = FromUtf8(Status.message());
	if (!Status.ok())
	{
		LogError(Error);
	}
	return Status.ok();
}

std::string ToKey(FName Name)
{
	return ToUtf8(Name.ToString().ToLower());
}

consac::Result<std::vector<consac::ParameterSpec>> ToParameters(const TArray<FConsacParameter>& Parameters)
{
	std::vector<consac::ParameterSpec> Converted;
	for (const FConsacParameter& Parameter : Parameters)
	{
		if (Parameter.Name == NAME_None)
		{
			return consac::Status(consac::StatusCode::kInvalidArgument, "environment parameter " + std::to_string(Converted.size()) + " has no name; give it one");
		}
		consac::ParameterSpec& Spec = Converted.emplace_back();
		Spec.name = ToKey(Parameter.Name);
		Spec.default_value = Parameter.Default;
		if (Parameter.bBounded)
		{
			Spec.low = Parameter.Low;
			Spec.high = Parameter.High;
		}
		Spec.description = ToUtf8(Parameter.Description);
	}
	return Converted;
}

consac::Result<double> DefaultOf(const TArray<FConsacParameter>& Parameters, FName Name)
{
	const consac::Result<std::vector<consac::ParameterSpec>> Specs = ToParameters(Parameters);
	if (!Specs.ok())
	{
		return Specs.status();
	}
	const consac::Result<std::size_t> At = consac::FindParameter(*Specs, ToKey(Name));
	return At.ok() ? consac::Result<double>((*Specs)[*At].default_value) : At.status();
}

float ValueOrLog(FName Name, const consac::Result<double>& Value)
{
	if (!Value.ok())
	{
		LogError(FString::Printf(TEXT("parameter '%s': %s"), *Name.ToString(), *FromUtf8(Value.status().message())));
		return 0.0f;
	}
	return static_cast<float>(*Value);
}

void NoteOrLog(consac::host::TickWorld& World, FName Name, float Value)
{
	if (const consac::Status Status = World.Note(ToKey(Name), static_cast<double>(Value)); !Status.ok())
	{
		LogError(FromUtf8(Status.message()));
	}
}

std::string ToParameterLaws(const TArray<FConsacParameter>& Parameters)
{
	std::string Laws;
	for (const FConsacParameter& Parameter : Parameters)
	{
		if (!Parameter.Training.IsEmpty())
		{
			Laws += (Laws.empty() ? "" : ", ") + ToKey(Parameter.Name) + "=" + ToUtf8(Parameter.Training);
		}
	}
	return Laws;
}

bool Answer(const consac::Status& Status, EConsacResult& Result, FString& Error)
{
	Result = Status.ok() ? EConsacResult::Success : EConsacResult::Failed;
	return Explain(Status, Error);
}

int32 CountOf(const consac::Layout& Layout)
{
	int64_t Count = 0;
	for (const consac::Leaf& Leaf : Layout.leaves)
	{
		Count += Leaf.count;
	}
	return static_cast<int32>(Count);
}

consac::Status WriteLeaf(const consac::Leaf& Leaf, std::byte* Row, const float* Values, int64 Count)
{
	if (Count != Leaf.count)
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, Counted(Leaf.name.empty() ? "the row" : Leaf.name.c_str(), Count, Leaf.count));
	}
	for (int64 Index = 0; Index < Count; ++Index)
	{
		if (!std::isfinite(Values[Index]))
		{
			return consac::Status(consac::StatusCode::kNonFinite, "number " + std::to_string(Index) + " is not finite; check what was divided by zero");
		}
	}
	if (Leaf.dtype == consac::DType::kF32)
	{
		std::memcpy(Row + Leaf.offset, Values, static_cast<std::size_t>(Count) * sizeof(float));
		return consac::Status::Ok();
	}
	for (int64 Index = 0; Index < Count; ++Index)
	{
		const std::pair<double, double> Bounds = consac::ElementBounds(Leaf, Index);
		consac::WriteElement(Leaf, Row, Index, std::clamp(static_cast<double>(Values[Index]), Bounds.first, Bounds.second));
	}
	return consac::Status::Ok();
}

consac::Status WriteRow(const consac::Layout& Layout, std::byte* Row, const float* Values, int64 Count)
{
	if (Count != CountOf(Layout))
	{
		return consac::Status(consac::StatusCode::kInvalidArgument, Counted("the observation", Count, CountOf(Layout)));
	}
	for (const consac::Leaf& Leaf : Layout.leaves)
	{
		CONSAC_RETURN_IF_ERROR(WriteLeaf(Leaf, Row, Values, Leaf.count));
		Values += Leaf.count;
	}
	return consac::Status::Ok();
}

void ReadLeaf(const consac::Leaf& Leaf, const std::byte* Row, TArray<float>& Values)
{
	for (int64_t Index = 0; Index < Leaf.count; ++Index)
	{
		Values.Add(static_cast<float>(consac::ReadElement(Leaf, Row, Index)));
	}
}

FConsacAction ToAction(const consac::Layout& Layout, const std::byte* Row)
{
	FConsacAction Action;
	for (const consac::Leaf& Leaf : Layout.leaves)
	{
		ReadLeaf(Leaf, Row, Action.Values);
	}
	if (!Layout.leaves.empty() && Layout.leaves[0].space.kind() == consac::SpaceKind::kDiscrete)
	{
		Action.Choice = static_cast<int32>(Action.Values[0]);
	}
	return Action;
}

FConsacProgress ToProgress(const consac::host::Progress& Progress)
{
	FConsacProgress Result;
	Result.State = FromUtf8(Progress.state);
	Result.Steps = Progress.steps;
	Result.TotalSteps = Progress.total_steps;
	Result.Episodes = Progress.tally.episodes;
	Result.Updates = Progress.updates;
	Result.MeanEpisodeReward = Progress.tally.episodes > 0 ? static_cast<float>(Progress.tally.mean_episode_reward) : 0.0f;
	Result.MeanEpisodeLength = Progress.tally.episodes > 0 ? static_cast<float>(Progress.tally.mean_episode_length) : 0.0f;
	Result.StepsPerSecond = static_cast<float>(Progress.agent_steps_per_s);
	Result.PollMilliseconds = static_cast<float>(Progress.poll_ms);
	return Result;
}

}
