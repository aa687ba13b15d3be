"""The experiments of the source papers, each as a command that prints the paper's numbers beside ours."""
