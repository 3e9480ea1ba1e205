// Copyright CONSAC authors. MIT License.
#include "ConsacTwin.h"

#include "ConsacConvert.h"
#include "ConsacCoreInclude.h"
#include "ConsacLog.h"
#include "ConsacTwinTable.h"
#include "Templates/PimplPtr.h"

namespace ConsacPlugin
{

constexpr consac::robot::Convention Unreal = consac::robot::Convention::kUnreal;
constexpr std::size_t MostTwinBytes = std::size_t{32} << 20;

FTransform ToTransform(const consac::robot::Transform& Frame)
{
	const consac::robot::Transform Written = consac::robot::TransformIn(Unreal, Frame);
	FTransform Made;
	Made.SetLocation(FVector(Written.position.x, Written.position.y, Written.position.z));
	Made.SetRotation(FQuat(Written.rotation.x, Written.rotation.y, Written.rotation.z, Written.rotation.w));
	return Made;
}

consac::robot::Transform FromTransform(const FTransform& Written)
{
	const FVector At = Written.GetLocation();
	const FQuat Turned = Written.GetRotation();
	return consac::robot::TransformFrom(Unreal, { { Turned.X, Turned.Y, Turned.Z, Turned.W }, { At.X, At.Y, At.Z } });
}

double ToDegreesOrCentimetres(const consac::robot::Joint& Joint, double Position)
{
	return consac::robot::JointIn(Unreal, Joint.type, Position);
}

double FromDegreesOrCentimetres(const consac::robot::Joint& Joint, double Position)
{
	return consac::robot::JointFrom(Unreal, Joint.type, Position);
}

// Fails where two of the names are one here.
template <class T>
static consac::Status NamesDiffer(const char* What, const std::vector<T>& Named)
{
	std::vector<std::string> Folded;
	for (const T& Row : Named)
	{
		Folded.push_back(ToUtf8(FromUtf8(Row.name).ToLower()));
	}
	std::sort(Folded.begin(), Folded.end());
	const auto Twice = std::adjacent_find(Folded.begin(), Folded.end());
	return Twice == Folded.end() ? consac::Status::Ok()
		: consac::Status(consac::StatusCode::kInvalidArgument,
			std::string("two ") + What + " of the twin are called " + consac::Quote(*Twice) + ", but for capitals, which names here do not know; rename one and import the robot again");
}

consac::Result<consac::robot::Robot> ReadTwin(std::span<const std::byte> Bytes)
{
	consac::Result<consac::robot::Robot> Robot = consac::robot::ReadTable(std::string_view(reinterpret_cast<const char*>(Bytes.data()), Bytes.size()));
	if (Robot.ok())
	{
		CONSAC_RETURN_IF_ERROR(NamesDiffer("joints", Robot->joints));
		CONSAC_RETURN_IF_ERROR(NamesDiffer("links", Robot->links));
	}
	return Robot;
}

// A joint as the Details panel shows it.
static std::string DescribeJoint(const consac::robot::Robot& Robot, const consac::robot::Joint& Joint)
{
	std::string Text = Joint.name + ": " + std::string(consac::robot::NameOf(Joint.type));
	if (Joint.position_index >= 0 && std::isfinite(Joint.drive.lower) && std::isfinite(Joint.drive.upper))
	{
		const auto Rounded = [&Joint](double Limit) { return consac::NumberText(std::round(ToDegreesOrCentimetres(Joint, Limit) * 100.0) / 100.0); };
		Text += ", " + Rounded(Joint.drive.lower) + " to " + Rounded(Joint.drive.upper) + (Joint.type == consac::robot::JointType::kPrismatic ? " cm" : " degrees");
	}
	return Joint.mimics >= 0 ? Text + ", follows " + Robot.LeaderOf(Joint).name : Text;
}

}

UConsacTwin::UConsacTwin()
	: Table(MakePimpl<FConsacTwinTable>())
{
}

const FConsacTwinTable* UConsacTwin::GetTable() const
{
	if (!Table->Robot && !File.IsEmpty() && !std::exchange(Table->bTried, true))
	{
		consac::Result<consac::robot::Robot> Read = ConsacPlugin::ReadTwin(ConsacPlugin::BytesOf(File));
		if (Read.ok())
		{
			Table->Robot.emplace(std::move(*Read));
		}
		else
		{
			ConsacPlugin::LogError(FString::Printf(TEXT("the twin %s: %s"), *GetName(), *ConsacPlugin::FromUtf8(Read.status().message())));
		}
	}
	return Table->Robot ? Table.Get() : nullptr;
}

bool UConsacTwin::IsTwinFile(const FString& Path)
{
	const consac::Result<std::vector<std::byte>> Bytes = consac::ReadFile(ConsacPlugin::ToFile(Path), ConsacPlugin::MostTwinBytes);
	return Bytes.ok() && std::string_view(reinterpret_cast<const char*>(Bytes->data()), Bytes->size()).find(consac::robot::kTableFormat) != std::string_view::npos;
}

bool UConsacTwin::Load(const FString& Path, FString& Error)
{
	const consac::Result<std::vector<std::byte>> Bytes = consac::ReadFile(ConsacPlugin::ToFile(Path), ConsacPlugin::MostTwinBytes);
	if (!Bytes.ok())
	{
		return ConsacPlugin::Explain(Bytes.status(), Error);
	}
	consac::Result<consac::robot::Robot> Read = ConsacPlugin::ReadTwin(*Bytes);
	if (!Read.ok())
	{
		return ConsacPlugin::Explain(consac::Status(Read.status().code(), ConsacPlugin::ToUtf8(Path) + ": " + Read.status().message()), Error);
	}
	File.SetNumUninitialized(static_cast<int32>(Bytes->size()));
	std::memcpy(File.GetData(), Bytes->data(), Bytes->size());
	Table->Robot.emplace(std::move(*Read));
	Describe();
	return ConsacPlugin::Explain(consac::Status::Ok(), Error);
}

void UConsacTwin::TakeOver(UConsacTwin& Loaded)
{
	File = Loaded.File;
	Table->Robot.emplace(std::move(*Loaded.Table->Robot));
	Loaded.Table->Robot.reset();
	Describe();
}

void UConsacTwin::SetTable(const FConsacTwinTable& NewTable)
{
	File.Reset();
	Table->Robot.emplace(*NewTable.Robot);
	Describe();
}

// For the Details panel, which shows what is saved.
void UConsacTwin::Describe()
{
	Robot = ConsacPlugin::FromUtf8(Table->Robot->name);
	Movable = Table->Robot->positions();
	Joints.Reset();
	for (const consac::robot::Joint& Joint : Table->Robot->joints)
	{
		Joints.Add(ConsacPlugin::FromUtf8(ConsacPlugin::DescribeJoint(*Table->Robot, Joint)));
	}
}

void UConsacTwin::BeginDestroy()
{
	if (Table.IsValid()) // a temporary object of Hot Reload has none
	{
		Table->Robot.reset();
	}
	Super::BeginDestroy();
}
