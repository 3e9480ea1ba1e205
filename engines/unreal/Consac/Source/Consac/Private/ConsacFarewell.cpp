// Copyright CONSAC authors. MIT License.
#include "ConsacFarewell.h"

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "ConsacConvert.h"
#include "ConsacLog.h"
#include "HAL/FileManager.h"
#include "Misc/Paths.h"

// Saves a demonstration, under a name that no file has yet: what a person has shown is not to be had again.
static consac::Status SaveDemonstration(const consac::host::Recorder& Recorder, const std::string& Folder, const std::string& Behaviour)
{
	if (Recorder.steps() == 0) // nobody has shown anything
	{
		return consac::Status::Ok();
	}
	std::string File;
	for (int32 Number = 1; Number == 1 || FPaths::FileExists(ConsacPlugin::FromUtf8(File)); ++Number)
	{
		File = Folder + "/" + consac::FileNameOf(Behaviour, Number == 1 ? ".safetensors" : "-" + std::to_string(Number) + ".safetensors");
	}
	const consac::Status Status = Recorder.Save(File);
	if (Status.ok())
	{
		UE_LOG(LogConsac, Display, TEXT("the demonstration of %lld steps is in %s"), static_cast<int64>(Recorder.steps()), *ConsacPlugin::FromUtf8(File));
	}
	return Status;
}

// Saves a model. One of an earlier training stays, beside the one that takes its name; where it cannot be kept it keeps its name, and
// the new one has another.
static consac::Status SaveModel(const consac::ModelFile& Model, const std::string& File)
{
	const FString Place = ConsacPlugin::FromUtf8(File);
	if (!FPaths::FileExists(Place))
	{
		return Model.Save(File);
	}
	const std::string Stem = File.substr(0, File.size() - std::string_view(".consac").size());
	const FString Kept = ConsacPlugin::FromUtf8(Stem + ".before.consac");
	const std::string New = Stem + ".new.consac";
	CONSAC_RETURN_IF_ERROR(Model.Save(New)); // where nothing can be written, nothing changes
	if (IFileManager::Get().Copy(*Kept, *Place) != COPY_OK)
	{
		return consac::Status(consac::StatusCode::kUnavailable, "the model " + File + " of an earlier training could not be kept as " + ConsacPlugin::ToUtf8(Kept) +
			" and was left alone: what was learned is in " + New + "; see that the first can be written");
	}
	UE_LOG(LogConsac, Display, TEXT("the model that was there before is now %s"), *Kept);
	CONSAC_RETURN_IF_ERROR(Model.Save(File));
	IFileManager::Get().Delete(*ConsacPlugin::FromUtf8(New));
	return consac::Status::Ok();
}

std::string FConsacFarewell::Save(std::string Fault) const
{
	// One after another: two at once may want one file, or find the same name free. The learner's end is not waited for in here.
	static std::mutex Saving;
	const std::lock_guard<std::mutex> Lock(Saving);
	for (const auto& [File, Model] : Models)
	{
		const consac::Status Status = SaveModel(Model, File);
		if (!Status.ok())
		{
			Fault = Status.message();
		}
		else
		{
			UE_LOG(LogConsac, Display, TEXT("what was learned is in %s"), *ConsacPlugin::FromUtf8(File));
		}
	}
	for (std::size_t B = 0; B < Recorders.size(); ++B)
	{
		const consac::Status Status = RecordFolder.empty() ? consac::Status::Ok() : SaveDemonstration(*Recorders[B], RecordFolder, Behaviours[B]);
		Fault = Status.ok() ? Fault : Status.message();
	}
	return Fault;
}

std::string FConsacFarewell::Do()
{
	std::string Fault;
	if (Driver && !ModelFolder.empty())
	{
		Fault = ConsacPlugin::CollectModels(*Driver, Behaviours, ModelFolder, ".stopped.consac", Models);
	}
	Fault = Save(std::move(Fault));
	Models.clear();
	Driver.reset();
	Recorders.clear();
	World.reset();
	return Fault;
}

namespace ConsacPlugin
{

std::string CollectModels(const consac::host::Driver& Driver, const std::vector<std::string>& Behaviours, const std::string& Folder, const char* Ending, FConsacModels& Models)
{
	std::string Fault;
	for (std::size_t B = 0; B < Behaviours.size(); ++B)
	{
		if (!Driver.learned(B)) // it is worth no file
		{
			continue;
		}
		consac::Result<consac::ModelFile> Model = Driver.Model(B);
		if (!Model.ok())
		{
			Fault = Model.status().message();
			continue;
		}
		Models.emplace_back(Folder + "/" + consac::FileNameOf(Behaviours[B], Ending), std::move(*Model));
	}
	return Fault;
}

struct FLeaving
{
	std::mutex Mutex;
	std::condition_variable Changed;
	FConsacFarewell Training;
	std::string Fault;
	bool bOut = false;      // it is done
	bool bAlone = false;    // nobody asks for it any more
	consac::Thread Thread;  // last: it has ended before the rest goes

	void Run()
	{
		const std::string Found = Training.Do();
		const std::lock_guard<std::mutex> Lock(Mutex);
		Fault = Found;
		bOut = true;
		if (bAlone && !Found.empty())
		{
			LogError(FromUtf8(Found));
		}
		Changed.notify_all();
	}
};

static std::vector<std::unique_ptr<FLeaving>> Leaving;

static void ForgetThoseOut()
{
	std::erase_if(Leaving, [](const std::unique_ptr<FLeaving>& One)
	{
		const std::lock_guard<std::mutex> Lock(One->Mutex);
		return One->bOut && One->bAlone;
	});
}

FLeaving& SendOut(FConsacFarewell Training)
{
	ForgetThoseOut();
	Leaving.push_back(std::make_unique<FLeaving>());
	FLeaving& One = *Leaving.back();
	One.Training = std::move(Training);
	const consac::Status Started = One.Thread.Start([&One] { One.Run(); });
	if (!Started.ok())
	{
		UE_LOG(LogConsac, Warning, TEXT("the game waits until what was learned is saved: %s"), *FromUtf8(Started.message()));
		One.Run();
	}
	return One;
}

bool IsOut(FLeaving& One, double MostSeconds)
{
	std::unique_lock<std::mutex> Lock(One.Mutex);
	return One.Changed.wait_for(Lock, std::chrono::duration<double>(MostSeconds), [&One] { return One.bOut; });
}

std::string Leave(FLeaving& One)
{
	const std::lock_guard<std::mutex> Lock(One.Mutex);
	One.bAlone = true;
	return One.Fault;
}

void AwaitFarewells()
{
	for (const std::unique_ptr<FLeaving>& One : Leaving)
	{
		if (!IsOut(*One, 0.0))
		{
			UE_LOG(LogConsac, Display, TEXT("the end waits until what was learned is saved"));
		}
	}
	Leaving.clear(); // each waits for its thread
}

}
