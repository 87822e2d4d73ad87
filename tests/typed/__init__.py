"""What users write, to be checked strictly; and the types of all that robostiff offers."""
