from training_stand_in import main

main(cut_back=True, step_seconds=0.0)
