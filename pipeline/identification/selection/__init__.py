"""Which effects the machine lacks, and which motion would decide."""
