#pragma once
/// Whom an import tells of its warnings.
class FFeedbackContext {};
