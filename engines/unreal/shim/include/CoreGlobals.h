#pragma once
class FOutputDeviceRedirector;
/// The log; none at the very end of a program.
extern FOutputDeviceRedirector* GLog;
