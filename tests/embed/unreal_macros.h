#pragma once
// Macros with the names that an Unreal translation unit (and the Windows headers behind it) defines before it sees a
// plugin's headers. Each expands to something that breaks any other use of the word.
#define check(expression) static_assert(false, "Unreal defines 'check'")
#define verify(expression) static_assert(false, "Unreal defines 'verify'")
#define ensure(expression) static_assert(false, "Unreal defines 'ensure'")
#define checkf(expression, ...) static_assert(false, "Unreal defines 'checkf'")
#define verifyf(expression, ...) static_assert(false, "Unreal defines 'verifyf'")
#define ensureMsgf(expression, ...) static_assert(false, "Unreal defines 'ensureMsgf'")
#define TEXT(text) L##text
#define PI (3.1415926535897932f)
#define TRUE 1
#define FALSE 0
#define IN
#define OUT
#define OPTIONAL
#define CONST const
#define VOID void
#define ERROR 0
#define near
#define far
#define interface struct
#define small char
#define Yield()
#define SendMessage SendMessageW
#define GetMessage GetMessageW
#define PostMessage PostMessageW
#define CreateEvent CreateEventW
#define CreateWindow CreateWindowW
#define GetObject GetObjectW
#define GetCurrentTime() GetTickCount()
#define LoadString LoadStringW
#define DrawText DrawTextW
#define GetClassName GetClassNameW
#define UpdateResource UpdateResourceW
#define INFINITE 0xFFFFFFFF
#define UINT unsigned
#define INT int
#define FLOAT float
#define DWORD unsigned
#define TCHAR wchar_t
