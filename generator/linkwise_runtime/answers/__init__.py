"""From packed values to answers: spread, summed over links, solved for accelerations."""
